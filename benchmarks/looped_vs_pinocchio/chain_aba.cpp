// Pinocchio's articulated-body algorithm on chains of pins, behind plain C functions.
//
// chain_new makes a chain of uniform rods (1 m along x, 1 kg) on pins whose axes alternate x, y, z;
// chain_aba evaluates `count` states, one after the other, in a native loop.  The workspace holds
// the arrays of this algorithm alone: pinocchio::Data(model) also sets up tensors of nv^3 numbers,
// for which a thousand bodies are too many.

#include <pinocchio/multibody.hpp>
#include <pinocchio/algorithm/aba.hpp>

namespace {

struct Chain {
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
pinocchio::JointIndex add(pinocchio::Model &model, pinocchio::JointIndex parent, const pinocchio::SE3 &at) {
  return model.addJoint(parent, Joint(), at, "");
}

void build(pinocchio::Model &model, int n, double transverse, double axial) {
  model.gravity.linear() = Eigen::Vector3d(0, 0, -9.81);
  const Eigen::Vector3d tip(1, 0, 0), center(0.5, 0, 0);
  const Eigen::Matrix3d inertia = Eigen::Vector3d(axial, transverse, transverse).asDiagonal();
  const pinocchio::Inertia rod(1.0, center, inertia);
  pinocchio::JointIndex parent = 0;
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector3d offset = i == 0 ? Eigen::Vector3d::Zero().eval() : tip;
    const pinocchio::SE3 at(Eigen::Matrix3d::Identity(), offset);
    switch (i % 3) {
      case 0: parent = add<pinocchio::JointModelRX>(model, parent, at); break;
      case 1: parent = add<pinocchio::JointModelRY>(model, parent, at); break;
      default: parent = add<pinocchio::JointModelRZ>(model, parent, at);
    }
    model.appendBodyToJoint(parent, rod, pinocchio::SE3::Identity());
  }
}

}  // namespace

extern "C" {

void *chain_new(int n, double transverse, double axial) {
  auto *chain = new Chain;
  build(chain->model, n, transverse, axial);
  reserve(chain->model, chain->data);
  return chain;
}

void chain_free(void *chain) { delete static_cast<Chain *>(chain); }

void chain_aba(void *chain, int count, int world, const double *q, const double *v, double *a) {
  auto &c = *static_cast<Chain *>(chain);
  const int n = c.model.nv;
  const Eigen::VectorXd tau = Eigen::VectorXd::Zero(n);
  using Input = Eigen::Map<const Eigen::VectorXd>;
  for (int k = 0; k < count; ++k) {
    const Input qk(q + k * n, n), vk(v + k * n, n);
    const auto &found = world ? pinocchio::aba(c.model, c.data, qk, vk, tau, pinocchio::Convention::WORLD)
                              : pinocchio::aba(c.model, c.data, qk, vk, tau, pinocchio::Convention::LOCAL);
    Eigen::Map<Eigen::VectorXd>(a + k * n, n) = found;
  }
}
}
