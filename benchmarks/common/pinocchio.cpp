// Pinocchio's articulated-body algorithm behind the signature of native.h.
//
// The workspace holds the arrays of this algorithm alone: pinocchio::Data(model) also sets up
// tensors of nv^3 numbers, for which a thousand bodies are too many.

#include <pinocchio/multibody.hpp>
#include <pinocchio/algorithm/aba.hpp>

#include "native.h"

namespace {

struct Tree {
  pinocchio::Model model;
  pinocchio::Data data;
};

void reserve(const pinocchio::Model &model, pinocchio::Data &data) {
  const auto n = static_cast<std::size_t>(model.njoints);
  const auto still = pinocchio::Motion::Zero();
  const auto none = pinocchio::Force::Zero();
  const auto here = pinocchio::SE3::Identity();
  for (auto *list : {&data.v, &data.ov, &data.a, &data.oa, &data.a_gf, &data.oa_gf}) list->assign(n, still);
  for (auto *list : {&data.f, &data.of, &data.h, &data.oh}) list->assign(n, none);
  for (auto *list : {&data.oMi, &data.liMi}) list->assign(n, here);
  for (auto *list : {&data.oYcrb, &data.oinertias}) list->assign(n, pinocchio::Inertia::Zero());
  for (auto *list : {&data.Yaba, &data.oYaba}) list->assign(n, pinocchio::Inertia::Matrix6::Zero());
  data.J.setZero(6, model.nv);
  data.u.setZero(model.nv);
  data.ddq.setZero(model.nv);
  data.a_gf[0] = -model.gravity;
  data.joints.reserve(n);
  for (const auto &joint : model.joints) data.joints.push_back(joint.createData());
}

template <class Joint>
pinocchio::JointIndex add(Tree &tree, int parent, const pinocchio::SE3 &at) {
  return tree.model.addJoint(static_cast<pinocchio::JointIndex>(parent + 1), Joint(), at, "");
}

template <pinocchio::Convention convention>
int evaluate(const double *context, const double *, const double *q, const double *u,
             const double *, const double *efforts, double *, double *udot) {
  auto &tree = *reinterpret_cast<Tree *>(const_cast<double *>(context));
  using Input = Eigen::Map<const Eigen::VectorXd>;
  const auto nv = tree.model.nv;
  const Input at_q(q, tree.model.nq), at_u(u, nv), tau(efforts, nv);
  Eigen::Map<Eigen::VectorXd>(udot, nv) = pinocchio::aba(tree.model, tree.data, at_q, at_u, tau, convention);
  return 0;
}

// The same with coordinate rates, which an integrator needs.
template <pinocchio::Convention convention>
int evaluate_with_rates(const double *context, const double *t, const double *q, const double *u,
                        const double *memory, const double *efforts, double *qdot, double *udot) {
  const auto &model = reinterpret_cast<const Tree *>(context)->model;
  for (pinocchio::JointIndex i = 1; i < model.joints.size(); ++i) {
    const auto &joint = model.joints[i];
    const double *x = q + joint.idx_q(), *w = u + joint.idx_v();
    double *rate = qdot + joint.idx_q();
    if (joint.nq() == 1) {
      rate[0] = w[0];
      continue;
    }
    const double a = 0.5 * w[0], b = 0.5 * w[1], c = 0.5 * w[2];  // x, y, z, w
    rate[0] = x[3] * a + x[1] * c - x[2] * b;
    rate[1] = x[3] * b + x[2] * a - x[0] * c;
    rate[2] = x[3] * c + x[0] * b - x[1] * a;
    rate[3] = -(x[0] * a + x[1] * b + x[2] * c);
  }
  return evaluate<convention>(context, t, q, u, memory, efforts, qdot, udot);
}

}  // namespace

extern "C" {

Tree *tree_new(const double *gravity) {
  auto *tree = new Tree;
  tree->model.gravity.linear() = Eigen::Vector3d(gravity);
  return tree;
}

// kind: 0, 1, 2 pin about x, y, z; 3 ball; 4 free.  Matrices row by row.
void tree_add(Tree *tree, int parent, int kind, const double *place, const double *turn, double mass,
              const double *center, const double *inertia, double armature) {
  using Matrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  const Matrix axes(turn);
  const Eigen::Vector3d from(place);
  const pinocchio::SE3 at(axes, from);
  pinocchio::JointIndex joint = 0;
  switch (kind) {
    case 0: joint = add<pinocchio::JointModelRX>(*tree, parent, at); break;
    case 1: joint = add<pinocchio::JointModelRY>(*tree, parent, at); break;
    case 2: joint = add<pinocchio::JointModelRZ>(*tree, parent, at); break;
    case 3: joint = add<pinocchio::JointModelSpherical>(*tree, parent, at); break;
    default: joint = add<pinocchio::JointModelFreeFlyer>(*tree, parent, at);
  }
  const Eigen::Vector3d mass_center(center);
  const Matrix about_center(inertia);
  const pinocchio::Inertia body(mass, mass_center, Eigen::Matrix3d(about_center));
  tree->model.appendBodyToJoint(joint, body, pinocchio::SE3::Identity());
  if (armature != 0) tree->model.armature[tree->model.nv - 1] = armature;
}

void tree_ready(Tree *tree) { reserve(tree->model, tree->data); }

void tree_free(Tree *tree) { delete tree; }

extern const accelerations local_aba = evaluate<pinocchio::Convention::LOCAL>;
extern const accelerations local_aba_rates = evaluate_with_rates<pinocchio::Convention::LOCAL>;
extern const accelerations world_aba_rates = evaluate_with_rates<pinocchio::Convention::WORLD>;
extern const accelerations world_aba = evaluate<pinocchio::Convention::WORLD>;
}
