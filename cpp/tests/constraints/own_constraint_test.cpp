// A constraint of one's own, as docs/how-to/add-a-constraint.md adds it: a frame stays above a plane.
#include <algorithm>
#include <boost/test/unit_test.hpp>
#include <limits>
#include <memory>
#include <stdexcept>

#include "sidestep/constraints/clearance_demand.hpp"
#include "sidestep/constraints/motion_program.hpp"
#include "support/allocations.hpp"
#include "support/numbers.hpp"
#include "support/serial_arm.hpp"

using namespace sidestep;
using test::nv;

namespace {

/// Keeps the origin of a frame above a horizontal plane: h = z − height ≥ margin.
class AbovePlane : public Constraint {
 public:
  /// Throws std::invalid_argument if no joint moves the frame.
  AbovePlane(const Robot& robot, const Frame& frame, double height, double margin)
      : robot_(robot),
        frame_(frame),
        height_(height),
        margin_(margin),
        state_(robot),
        gradient_(Eigen::VectorXd::Zero(robot.num_coordinates())) {
    if (frame.joint < 0) {
      throw std::invalid_argument("above plane: no joint moves frame '" + frame.name + "'");
    }
  }

  Priority priority() const noexcept override { return Priority::clearance; }
  int max_rows() const noexcept override { return 1; }

  void append(const Moment& now, Bounds&, RowBlock& rows) noexcept override {
    state_.update(robot_, now.position, now.velocity);
    const KinematicState::Link& link = state_.link(frame_.joint);
    const Eigen::Vector3d p = link.p_WL + link.R_WL * frame_.X_JF.translation(), up = Eigen::Vector3d::UnitZ();
    const Eigen::Vector3d p_dot = link.velocity.linear + link.velocity.angular.cross(p);
    const Eigen::Vector3d bias = link.bias.linear + link.bias.angular.cross(p) + link.velocity.angular.cross(p_dot);
    gradient_.setZero();
    accumulate_generalised_force(state_, frame_.joint, {p.cross(up), up}, gradient_);  // ∂z/∂q
    const double h = p.z() - height_;
    const ClosingLimits limits{1.0, 2.0, 20.0, 0.5};  // [m/s², m/s², 1/s, -]
    const double least = demanded_deceleration(h - margin_, -p_dot.z(), limits, now.period) - bias.z();
    rows.at_least(gradient_, least, std::max(-h, 0.0));
  }

 private:
  Robot robot_;
  Frame frame_;
  double height_, margin_;
  KinematicState state_;
  Eigen::VectorXd gradient_;
};

/// The least height of the tip in 2.5 s in which the arm is driven to bend over.
double least_height(const Robot& arm, MotionProgram& program) {
  MotionSolution solution(nv);
  Eigen::VectorXd q = Eigen::VectorXd::Zero(nv), v = q, wanted = q;
  const Eigen::VectorXd bias = q;
  const Eigen::MatrixXd mass = Eigen::MatrixXd::Identity(nv, nv);
  KinematicState state(arm);
  double least = std::numeric_limits<double>::infinity();
  wanted[1] = 1.0;
  for (int k = 0; k < 2500; ++k) {
    BOOST_REQUIRE_EQUAL(test::allocations_of([&] { static_cast<void>(program.solve({q, v, wanted, mass, bias}, solution)); }),
                        0u);
    BOOST_REQUIRE_MESSAGE(solution.status <= ProgramStatus::limited, name(solution.status)
                                                                         << " in step " << k << ", " << least << " m");
    q += 0.001 * v + 0.5e-6 * solution.acceleration;
    v += 0.001 * solution.acceleration;
    state.update(arm, q, v);
    least = std::min(least, frame_pose(state, arm.frames()[0]).translation().z());
  }
  return least;
}

MotionProgram::Constraints above(const Robot& arm, double height, double margin) {
  MotionProgram::Constraints own;
  own.push_back(std::make_unique<AbovePlane>(arm, arm.frames()[0], height, margin));
  return own;
}

/// A constraint whose rows would give way with jerk.
struct OfJerk : Constraint {
  Priority priority() const noexcept override { return Priority::jerk; }
  int max_rows() const noexcept override { return 1; }
  void append(const Moment&, Bounds&, RowBlock&) noexcept override {}
};

/// Rows of one's own choosing on joint 0.
struct OnFirstJoint : Constraint {
  OnFirstJoint(Priority p, double lowest, double most) : priority_(p), lowest_(lowest), most_(most) {}
  Priority priority() const noexcept override { return priority_; }
  int max_rows() const noexcept override { return 2; }
  void append(const Moment&, Bounds&, RowBlock& rows) noexcept override {
    const Eigen::VectorXd first = Eigen::VectorXd::Unit(nv, 0);
    rows.at_least(first, lowest_);
    rows.at_most(first, most_);
  }
  Priority priority_;
  double lowest_, most_;
};

/// The acceleration of joint 0 that a program gives which wants none.
double first_acceleration(const Robot& arm, bool by_torque, MotionProgram::Constraints own, ProgramStatus expected) {
  MotionProgramSettings settings;
  settings.by_torque = by_torque;
  MotionProgram program(arm, settings, std::move(own));
  MotionSolution solution(nv);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(nv);
  const Eigen::MatrixXd mass = Eigen::MatrixXd::Identity(nv, nv);
  BOOST_TEST((program.solve({zero, zero, zero, mass, zero}, solution) == expected), name(solution.status));
  return solution.acceleration[0];
}

template <class... One>
MotionProgram::Constraints list(One... one) {
  MotionProgram::Constraints own;
  (own.push_back(std::make_unique<One>(one)), ...);
  return own;
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_frame_stays_above_a_plane) {
  const Robot arm = test::serial_arm(test::arm_limits(nv));
  for (const bool by_torque : {true, false}) {
    MotionProgramSettings settings;
    settings.by_torque = by_torque;
    MotionProgram without(arm, settings), with(arm, settings, above(arm, 1.2, 0.005));
    BOOST_TEST(least_height(arm, without) < 1.0);
    const double least = least_height(arm, with);
    BOOST_TEST(least >= 1.205 - 1e-6);  // terms of order T² of the arc
    BOOST_TEST(least < 1.205 + 1e-3);   // the margin is reached, not more is kept
  }
}

BOOST_AUTO_TEST_CASE(a_frame_that_no_joint_moves_is_refused) {
  const Robot arm = test::serial_arm(test::arm_limits(nv));
  Frame fixed = arm.frames()[0];
  fixed.joint = -1;
  BOOST_CHECK_THROW(AbovePlane(arm, fixed, 0.0, 0.0), std::invalid_argument);
}

BOOST_AUTO_TEST_CASE(one_row_is_appended_of_the_height_as_it_is) {
  const Robot arm = test::serial_arm(test::arm_limits(nv));
  AbovePlane constraint(arm, arm.frames()[0], 1e3, 0.005);  // the frame is far below
  const Eigen::VectorXd q = Eigen::VectorXd::Constant(nv, 0.3), v = Eigen::VectorXd::Zero(nv);
  const LastCommand last{};
  const SecondState second{};
  const SpeedLimitNow speed{};
  const Survey found{};
  const Moment now{0.001, 1.0, 0.0, 0.001, q, v, nullptr, nullptr, 1.0, false, last, nullptr, second, speed, found};
  RowBlock rows(constraint.max_rows(), nv, constraint.priority());
  Bounds bounds(nv);
  constraint.append(now, bounds, rows);
  BOOST_TEST(rows.size == 1);
  BOOST_TEST(rows.depths[0] > 990.0);  // the arm is no longer than 10 m
}

BOOST_AUTO_TEST_CASE(rows_of_ones_own_give_way_by_their_priority) {
  const Robot arm = test::serial_arm(test::arm_limits(nv));
  const auto close = boost::test_tools::tolerance(1e-4);
  using P = Priority;
  constexpr double inf = std::numeric_limits<double>::infinity();
  // Kept where they can be.
  for (const P p : {P::never, P::clearance, P::comfort}) {
    BOOST_TEST(first_acceleration(arm, true, list(OnFirstJoint(p, 2.0, inf)), ProgramStatus::limited) == 2.0, close);
    BOOST_TEST(first_acceleration(arm, false, list(OnFirstJoint(p, -inf, -3.0)), ProgramStatus::limited) == -3.0, close);
  }
  // Of two clearances that contradict each other each falls short by the same.
  BOOST_TEST(first_acceleration(arm, true, list(OnFirstJoint(P::clearance, 5.0, 1.0)), ProgramStatus::relaxed_safety) == 3.0,
             close);
  // Comfort gives way to clearances, clearances to what never does.
  BOOST_TEST(first_acceleration(arm, true, list(OnFirstJoint(P::comfort, -inf, 1.0), OnFirstJoint(P::clearance, 4.0, inf)),
                                ProgramStatus::relaxed) == 4.0,
             close);
  BOOST_TEST(first_acceleration(arm, true, list(OnFirstJoint(P::never, -inf, 1.0), OnFirstJoint(P::clearance, 4.0, inf)),
                                ProgramStatus::relaxed_safety) == 1.0,
             close);
  // Acceleration limits of 10 give way to clearances, unless they are what drives can do.
  BOOST_TEST(first_acceleration(arm, true, list(OnFirstJoint(P::clearance, 20.0, inf)), ProgramStatus::relaxed) == 20.0, close);
  BOOST_TEST(first_acceleration(arm, false, list(OnFirstJoint(P::clearance, 20.0, inf)), ProgramStatus::relaxed_safety) == 10.0,
             close);
  // What never gives way and contradicts itself leaves the damped stop.
  BOOST_TEST(first_acceleration(arm, true, list(OnFirstJoint(P::never, 2.0, 1.0)), ProgramStatus::fallback_solver) == 0.0);
}

BOOST_AUTO_TEST_CASE(rows_give_way_by_three_priorities_only) {
  const Robot arm = test::serial_arm(test::arm_limits(nv));
  BOOST_CHECK_THROW(MotionProgram(arm, {}, list(OfJerk())), std::invalid_argument);
}
