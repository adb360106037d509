// Objects that are attached and let go, and bodies that are replaced, while steps run.
#include <atomic>
#include <boost/test/unit_test.hpp>
#include <chrono>
#include <functional>
#include <stdexcept>
#include <string>
#include <thread>

#include "sidestep/controller/controller.hpp"
#include "support/allocations.hpp"
#include "support/covered_arm.hpp"
#include "support/numbers.hpp"

using namespace sidestep;
using test::covered_arm;
using test::nv;

namespace {

/// A bar along z from the tip of the arm on, of half a metre.
Attachment bar(const std::string& name = "bar") {
  Attachment object;
  object.name = name;
  object.link = "tip";
  object.X_LA.translation().z() = 0.25;
  object.cover.centres.push_back(Eigen::Vector3d::Zero());
  object.cover.shapes.push_back(Eigen::Vector3d(0.03, 0.03, 0.25).asDiagonal());
  object.inertial = {0.4, Eigen::Vector3d::Zero(), Eigen::Vector3d(8e-3, 8e-3, 1e-4).asDiagonal()};
  return object;
}

ControllerSettings synchronous(ControllerSettings::Output output) {
  ControllerSettings settings;
  settings.synchronous = true;
  settings.output = output;
  return settings;
}

void move(const Command& command, Eigen::VectorXd& q, Eigen::VectorXd& v) {
  v += 0.001 * command.acceleration;
  q += 0.001 * v;
}

std::string what_is_said(const std::function<void()>& action) {
  try {
    action();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "";
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_change_of_body_makes_no_step_in_acceleration) {
  const JointLimits limits = test::arm_limits(nv);
  for (const auto output : {ControllerSettings::Output::torque, ControllerSettings::Output::acceleration}) {
    Controller controller(covered_arm(limits), synchronous(output));
    controller.set_obstacles(Obstacles::none());
    controller.set_goal(Eigen::VectorXd::Constant(nv, 0.4));
    Eigen::VectorXd q = Eigen::VectorXd::Constant(nv, -0.3), v = Eigen::VectorXd::Zero(nv), before = v;
    double fastest = 0.0, jump = 0.0;
    for (int k = 0; k < 6000; ++k) {
      if (k == 150) {
        controller.attach(bar());
      } else if (k == 300) {
        controller.detach("bar");
      } else if (k == 350) {
        controller.set_arm(covered_arm(limits, false));
      }
      const Command& command = controller.step(q, v);
      fastest = k == 150 ? command.velocity.cwiseAbs().maxCoeff() : fastest;
      jump = std::max(
          jump,
          ((command.acceleration - before).cwiseAbs().array() / controller.arm().robot().limits().jerk.array()).maxCoeff());
      before = command.acceleration;
      move(command, q, v);
    }
    BOOST_TEST(fastest > 0.1);              // it was under way
    BOOST_TEST(jump < 0.001 * (1 + 1e-9));  // a period of the limit
    BOOST_TEST((q.array() - 0.4).abs().maxCoeff() < 1e-3);
  }
}

BOOST_AUTO_TEST_CASE(what_is_attached_weighs_and_keeps_off) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  Controller controller(arm, synchronous(ControllerSettings::Output::torque));
  controller.set_obstacles(Obstacles::none());
  Eigen::VectorXd q = Eigen::VectorXd::Constant(nv, 0.3), v = Eigen::VectorXd::Zero(nv);
  const auto at_rest = [&] {
    for (int k = 0; k < 2000; ++k) {
      move(controller.step(q, v), q, v);
    }
  };
  const auto weight = [&](const Arm& of) {
    const RigidBodyDynamics dynamics = of.dynamics();
    RigidBodyDynamics::Workspace w(dynamics);
    Eigen::VectorXd bias(nv);
    dynamics.bias(q, v, w, bias);
    return bias;
  };
  at_rest();
  BOOST_TEST((controller.command().torque - weight(arm)).norm() < 1e-6);
  controller.attach(bar());
  at_rest();
  const Arm larger = controller.arm();
  const Eigen::VectorXd heavier = weight(larger);
  BOOST_TEST((heavier - weight(arm)).norm() > 0.5);
  BOOST_TEST((controller.command().torque - heavier).norm() < 1e-6);
  BOOST_TEST(larger.pairs().size() == arm.pairs().size() + nv - 1);  // with all links but the one that holds it
  BOOST_TEST(controller.attached() == std::vector<std::string>{"bar"});

  // A ball 5 cm before its end, where the bare arm is far from it.
  const Eigen::Isometry3d X = frame_pose(larger.robot(), test::state_at(larger.robot(), q), larger.robot().frame_index("bar"));
  controller.set_obstacles(test::ball(X * Eigen::Vector3d(0.0, 0.0, 0.35), 0.05));
  controller.step(q, v);
  BOOST_TEST(std::abs(controller.command().clearance - 0.05) < 1e-9);
  controller.detach("bar");
  controller.step(q, v);
  BOOST_TEST(controller.command().clearance > 0.2);
  BOOST_TEST(controller.arm().content_hash() == arm.content_hash());
}

BOOST_AUTO_TEST_CASE(links_that_overlap_it_when_it_is_taken_may_stay_as_near_as_they_are) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  Attachment object = bar();
  object.X_LA.translation().z() = -0.3;  // back along the last link, into the one before
  const Eigen::VectorXd q = Eigen::VectorXd::Constant(nv, 0.2);
  double least = 0.0;
  const Arm there = attach(arm, object, q), somewhere = attach(arm, object);
  for (const LinkPair& pair : there.pairs()) {
    least = std::min(least, pair.contact);
  }
  BOOST_TEST(least < -0.01);
  for (const LinkPair& pair : somewhere.pairs()) {
    BOOST_TEST(pair.contact == 0.0);  // nobody says where the arm was
  }
  Controller controller(arm, synchronous(ControllerSettings::Output::acceleration));
  controller.set_obstacles(Obstacles::none());
  controller.step(q, Eigen::VectorXd::Zero(nv));
  controller.attach(object);
  controller.step(q, Eigen::VectorXd::Zero(nv));
  BOOST_TEST((controller.command().status < SafetyStatus::clearance_lost));
  BOOST_TEST(std::abs(controller.command().clearance - attached_distance) < 1e-9);
  object.may_touch = {"link" + std::to_string(nv - 1)};
  BOOST_TEST(attach(arm, object, q).pairs().size() == arm.pairs().size() + nv - 2);
  BOOST_TEST(attach(arm, object, q).allowed_pairs().size() == 1U);
}

BOOST_AUTO_TEST_CASE(steps_allocate_nothing_while_another_thread_attaches_and_detaches) {
  ControllerSettings settings;
  settings.planner->search.shortcuts = 20;
  settings.look_ahead->tries = 30;
  Controller controller(covered_arm(test::arm_limits(nv)), settings);
  controller.set_obstacles(Obstacles::none());
  controller.set_goal(Eigen::VectorXd::Constant(nv, -0.3));
  std::atomic<bool> done{false};
  std::thread other([&] {
    for (int k = 0; k < 12; ++k) {
      k % 2 == 0 ? static_cast<void>(controller.attach(bar())) : controller.detach("bar");
      controller.set_goal(Eigen::VectorXd::Constant(nv, k % 4 < 2 ? 0.3 : -0.3));
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    done = true;
  });
  Eigen::VectorXd q = Eigen::VectorXd::Constant(nv, 0.3), v = Eigen::VectorXd::Zero(nv);
  std::size_t allocations = 0, changes = 0, coordinates = 0;
  while (!done.load()) {
    allocations += test::allocations_of([&] { controller.step(q, v); });
    changes += coordinates != controller.labels().size();
    coordinates = controller.labels().size();
    move(controller.command(), q, v);
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  other.join();
  BOOST_TEST(allocations == 0U);
  BOOST_TEST(changes > 4U);
}

BOOST_AUTO_TEST_CASE(orders_go_on_where_they_were) {
  const JointLimits limits = test::arm_limits(nv);
  const auto end_of = [&](bool changes) {
    Controller controller(covered_arm(limits), synchronous(ControllerSettings::Output::acceleration));
    controller.set_obstacles(Obstacles::none());
    Eigen::MatrixXd path(nv, 3);
    path << Eigen::VectorXd::Constant(nv, -0.2), Eigen::VectorXd::Constant(nv, 0.1), Eigen::VectorXd::Constant(nv, 0.3);
    Eigen::VectorXd q = path.col(0), v = Eigen::VectorXd::Zero(nv);
    controller.set_trajectory(path, Eigen::Vector3d(0.0, 1.0, 2.0));
    controller.set_obstacles(test::ball({3.0, 0.0, 0.0}, 0.1, {0.1, 0.0, 0.0}), test::for_ever);
    for (int k = 0; k < 1500; ++k) {
      if (changes && k == 700) {
        controller.attach(bar());
      }
      move(controller.step(q, v), q, v);
    }
    BOOST_TEST(std::abs(controller.obstacles().points()(0, 0) - 3.1499) < 1e-6);  // it moved on through the change
    return q;
  };
  BOOST_TEST((end_of(true) - end_of(false)).norm() < 1e-3);  // of a metre of way: the clock stood still nowhere
}

BOOST_AUTO_TEST_CASE(what_is_wrong_is_named_and_nothing_changes) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  Controller controller(arm, synchronous(ControllerSettings::Output::acceleration));
  controller.set_obstacles(Obstacles::none());
  const auto refusal = [&](const std::function<void(Attachment&)>& spoil) {
    Attachment object = bar();
    spoil(object);
    return what_is_said([&] { controller.attach(object); });
  };
  const auto holds = [](const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; };
  BOOST_TEST(holds(refusal([](Attachment& a) { a.name = "link1"; }), "has a frame of this name"));
  BOOST_TEST(holds(refusal([](Attachment& a) { a.link = "nowhere"; }), "nowhere"));
  BOOST_TEST(holds(refusal([](Attachment& a) { a.cover = {}; }), "no ellipsoid"));
  BOOST_TEST(holds(refusal([](Attachment& a) { a.cover.shapes[0].setZero(); }), "ellipsoid 0"));
  BOOST_TEST(holds(refusal([](Attachment& a) { a.X_LA.translation().x() = test::not_a_number; }), "pose"));
  BOOST_TEST(holds(refusal([](Attachment& a) { a.inertial.mass = -1.0; }), "mass"));
  BOOST_TEST(holds(refusal([](Attachment& a) { a.may_touch = {"nowhere"}; }), "nowhere"));
  BOOST_TEST(holds(what_is_said([&] { controller.detach("cup"); }), "attached: none"));
  controller.attach(bar());
  BOOST_TEST(holds(what_is_said([&] { controller.attach(bar()); }), "has a frame of this name"));
  BOOST_TEST(holds(what_is_said([&] { controller.detach("cup"); }), "'bar'"));
  JointLimits other = test::arm_limits(nv);
  other.velocity *= 2.0;
  BOOST_TEST(holds(what_is_said([&] { controller.set_arm(covered_arm(other)); }), "other limits"));
  BOOST_TEST(controller.attached() == std::vector<std::string>{"bar"});
}

BOOST_AUTO_TEST_CASE(the_command_is_the_same_object_through_every_change) {
  Controller controller(covered_arm(test::arm_limits(nv)), synchronous(ControllerSettings::Output::acceleration));
  controller.set_obstacles(Obstacles::none());
  const Command& command = controller.command();
  Eigen::VectorXd q = Eigen::VectorXd::Constant(nv, 0.3), v = Eigen::VectorXd::Zero(nv);
  for (int k = 0; k < 5; ++k) {
    k % 2 == 0 ? static_cast<void>(controller.attach(bar())) : controller.detach("bar");
    BOOST_TEST(&controller.step(q, v) == &command);
    BOOST_TEST(command.position == q);
  }
}

BOOST_AUTO_TEST_CASE(a_load_that_is_told_late_is_not_counted_twice) {
  // The arm carries the bar before the controller is told of it: the observer has its weight.
  const Arm bare = covered_arm(test::arm_limits(nv));
  const Arm loaded = attach(bare, bar());
  const RigidBodyDynamics dynamics = loaded.dynamics();
  RigidBodyDynamics::Workspace w(dynamics);
  Controller controller(bare, synchronous(ControllerSettings::Output::torque));
  controller.set_obstacles(Obstacles::none());
  Eigen::VectorXd q = Eigen::VectorXd::Constant(nv, 0.3), v = Eigen::VectorXd::Zero(nv), bias(nv);
  Eigen::MatrixXd mass(nv, nv);
  double moved = 0.0;
  for (int k = 0; k < 3000; ++k) {
    if (k == 2000) {
      BOOST_TEST(controller.command().observed.disturbance.norm() > 0.5);
      controller.attach(bar());
    }
    const Command& command = controller.step(q, v);
    KinematicState state(loaded.robot());
    state.update(loaded.robot(), q, v);
    dynamics.mass_matrix(state, w, mass);
    dynamics.bias(state, w, bias);
    v += 0.001 * mass.ldlt().solve(command.torque - bias);
    q += 0.001 * v;
    moved = k >= 2000 ? std::max(moved, v.cwiseAbs().maxCoeff()) : 0.0;
  }
  BOOST_TEST(controller.command().observed.disturbance.norm() < 0.05);
  BOOST_TEST(moved < 0.01);  // [rad/s]; counted twice it moves by some 0.1
}

BOOST_AUTO_TEST_CASE(an_object_that_others_name_can_be_let_go) {
  Controller controller(covered_arm(test::arm_limits(nv)), synchronous(ControllerSettings::Output::acceleration));
  controller.set_obstacles(Obstacles::none());
  controller.attach(bar());
  Attachment lid = bar("lid");
  lid.may_touch = {"bar"};
  controller.attach(lid);
  Attachment knob = bar("knob");
  knob.link = "lid";
  controller.attach(knob);
  controller.detach("bar");
  BOOST_TEST((controller.attached() == std::vector<std::string>{"lid", "knob"}));
  BOOST_TEST(what_is_said([&] { controller.detach("lid"); }).find("'knob' is attached to 'lid'") != std::string::npos);
}

BOOST_AUTO_TEST_CASE(what_stands_on_something_may_until_it_is_lifted) {
  const Arm arm = covered_arm(test::arm_limits(nv));
  for (const bool one_thread : {true, false}) {
    ControllerSettings settings = synchronous(ControllerSettings::Output::acceleration);
    settings.synchronous = one_thread;
    Controller controller(arm, settings);
    controller.set_obstacles(Obstacles::none());
    Eigen::VectorXd q = Eigen::VectorXd::Constant(nv, 0.3), v = Eigen::VectorXd::Zero(nv);
    const Eigen::VectorXd start = q;
    Attachment object = bar();
    object.rests_on = {"ball"};
    BOOST_TEST(what_is_said([&] { controller.attach(object); }).find("step once before") != std::string::npos);
    const Eigen::Isometry3d X_WA = [&] {
      const Arm larger = attach(arm, bar());
      return frame_pose(larger.robot(), test::state_at(larger.robot(), q), larger.robot().frame_index("bar"));
    }();
    // 8 mm inside the end of the bar.
    const Obstacles ball = test::ball(X_WA * Eigen::Vector3d(0.0, 0.0, 0.242 + 0.05), 0.05).named({"ball"}, {1});
    controller.set_obstacles(ball);
    controller.step(q, v);
    object.rests_on = {"table"};
    BOOST_TEST(what_is_said([&] { controller.attach(object); }).find("there are: 'ball'") != std::string::npos);
    object.rests_on = {"ball"};
    controller.set_obstacles(test::ball(X_WA * Eigen::Vector3d(0.0, 0.0, 0.21 + 0.05), 0.05).named({"ball"}, {1}));
    controller.step(q, v);
    BOOST_TEST(what_is_said([&] { controller.attach(object); }).find(" mm deep in 'ball'") != std::string::npos);
    controller.set_obstacles(ball);
    controller.step(q, v);
    controller.attach(object);
    const auto run = [&](int steps) {
      double least = 1.0;
      for (int k = 0; k < steps; ++k) {
        const Command& command = controller.step(q, v);
        least = std::min(least, command.clearance);
        move(command, q, v);
      }
      return least;
    };
    BOOST_TEST(run(500) > 0.005);  // nothing is lost
    BOOST_TEST((q - start).cwiseAbs().maxCoeff() < 1e-3);
    BOOST_TEST(controller.arm().body().covariances.back()(2, 2) < 0.98 * attach(arm, object).body().covariances.back()(2, 2));
    // Away and back: the whole bar keeps off.
    controller.set_goal(Eigen::VectorXd::Constant(nv, -0.2));
    BOOST_TEST(run(4000) > 0.0);
    BOOST_TEST((q.array() + 0.2).abs().maxCoeff() < 0.02);
    BOOST_TEST(controller.arm().content_hash() == attach(arm, object).content_hash());
    controller.set_goal(start);
    BOOST_TEST(run(4000) > 0.0);
    BOOST_TEST((q - start).cwiseAbs().maxCoeff() > 0.005);
    controller.detach("bar");
    run(4000);
    BOOST_TEST((q - start).cwiseAbs().maxCoeff() < 1e-3);
  }
}
