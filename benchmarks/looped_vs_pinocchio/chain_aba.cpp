// Pinocchio's articulated-body algorithm on chains of pins, behind plain C functions.
//
// chain_new makes a chain of uniform rods (1 m along x, 1 kg) on pins whose axes alternate x, y, z;
// chain_aba evaluates `count` states, one after the other, in a native loop.

#include <pinocchio/multibody.hpp>
#include <pinocchio/algorithm/aba.hpp>

namespace {

struct Chain {
  pinocchio::Model model;
  pinocchio::Data data;
  explicit Chain(const pinocchio::Model &m) : model(m), data(model) {}
};

template <class Joint>
pinocchio::JointIndex add(pinocchio::Model &model, pinocchio::JointIndex parent, const pinocchio::SE3 &at) {
  return model.addJoint(parent, Joint(), at, "");
}

pinocchio::Model chain_model(int n, double transverse, double axial) {
  pinocchio::Model model;
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
  return model;
}

}  // namespace

extern "C" {

void *chain_new(int n, double transverse, double axial) {
  return new Chain(chain_model(n, transverse, axial));
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
