// Andrews' squeezer by Pinocchio: seven bodies on pins, closed by three constraints of points.

#include <pinocchio/multibody.hpp>
#include <pinocchio/constraints.hpp>
#include <pinocchio/algorithm/constrained-dynamics.hpp>

#include "native.h"

namespace {

using Vector3 = Eigen::Vector3d;

// Motor on the first joint; spring from `foot` on the ground to `end` on a body that a pin at `pin`
// holds on the ground, so that its load is a moment about that pin.
struct Squeezer {
  pinocchio::Model model;
  pinocchio::Data data;
  std::vector<pinocchio::RigidConstraintModel> loops;
  std::vector<pinocchio::RigidConstraintData> loop_data;
  pinocchio::ProximalSettings settings{1e-12, 1e-10, 10};
  Eigen::VectorXd efforts;
  double torque, stiffness, rest;
  Eigen::Vector2d foot, pin, end;
  pinocchio::JointIndex sprung;
};

int evaluate(const double *context, const double *, const double *q, const double *u, const double *,
             const double *, double *qdot, double *udot) {
  auto &made = *reinterpret_cast<Squeezer *>(const_cast<double *>(context));
  using Input = Eigen::Map<const Eigen::VectorXd>;
  const auto nv = made.model.nv;
  const Input at_q(q, nv), at_u(u, nv);
  Eigen::Map<Eigen::VectorXd>(qdot, nv) = at_u;
  const auto place = made.model.joints[made.sprung].idx_q();
  const double c = std::cos(q[place]), s = std::sin(q[place]);
  const Eigen::Vector2d arm(c * made.end[0] - s * made.end[1], s * made.end[0] + c * made.end[1]);
  const Eigen::Vector2d along = made.pin + arm - made.foot;
  const double length = along.norm();
  const Eigen::Vector2d force = -made.stiffness * (length - made.rest) / length * along;
  made.efforts[0] = made.torque;
  made.efforts[place] = arm[0] * force[1] - arm[1] * force[0];
  Eigen::Map<Eigen::VectorXd>(udot, nv) = pinocchio::constraintDynamics(
      made.model, made.data, at_q, at_u, made.efforts, made.loops, made.loop_data, made.settings);
  return 0;
}

}  // namespace

extern "C" {

Squeezer *squeezer_new(double torque, double stiffness, double rest, const double *points,
                       int sprung) {
  auto *made = new Squeezer;
  made->model.gravity.setZero();
  made->torque = torque, made->stiffness = stiffness, made->rest = rest;
  made->foot = Eigen::Vector2d(points), made->pin = Eigen::Vector2d(points + 2);
  made->end = Eigen::Vector2d(points + 4);
  made->sprung = static_cast<pinocchio::JointIndex>(sprung + 1);
  return made;
}

// A body on a pin about z at `place` of body `parent`, -1 for the ground.
void squeezer_body(Squeezer *made, int parent, const double *place, double mass, const double *center,
                   double moment) {
  const auto joint = made->model.addJoint(static_cast<pinocchio::JointIndex>(parent + 1),
                                          pinocchio::JointModelRZ(),
                                          pinocchio::SE3(Eigen::Matrix3d::Identity(), Vector3(place)), "");
  const Eigen::Matrix3d about = Vector3(moment, moment, moment).asDiagonal();
  made->model.appendBodyToJoint(joint, pinocchio::Inertia(mass, Vector3(center), about),
                                pinocchio::SE3::Identity());
}

void squeezer_loop(Squeezer *made, int one, const double *place, int other, const double *there) {
  const Eigen::Matrix3d level = Eigen::Matrix3d::Identity();
  made->loops.emplace_back(pinocchio::CONTACT_3D, made->model,
                           static_cast<pinocchio::JointIndex>(one + 1),
                           pinocchio::SE3(level, Vector3(place)),
                           static_cast<pinocchio::JointIndex>(other + 1),
                           pinocchio::SE3(level, Vector3(there)), pinocchio::LOCAL);
}

void squeezer_ready(Squeezer *made) {
  made->data = pinocchio::Data(made->model);
  made->efforts.setZero(made->model.nv);
  for (const auto &loop : made->loops) made->loop_data.emplace_back(loop);
  pinocchio::initConstraintDynamics(made->model, made->data, made->loops, made->loop_data);
}

void squeezer_free(Squeezer *made) { delete made; }

extern const accelerations squeezer_rates = evaluate;
}
