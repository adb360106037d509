// Rigid-body dynamics of random trees against sums over links of what their Jacobians say.
#include "sidestep/robot/dynamics.hpp"

#include <boost/test/unit_test.hpp>

#include "support/allocations.hpp"
#include "support/random_scene.hpp"

using namespace sidestep;
using test::Random;

namespace {

constexpr double tolerance = 1e-10;  // rounding of sums of numbers up to about 100

Inertial random_inertial(Random& random) {
  Inertial body;
  body.mass = random.uniform(0.1, 5.0);
  body.com = 0.1 * random.vector(3);
  body.inertia = 0.01 * random.positive_definite(3, 0.1);
  return body;
}

std::vector<Inertial> random_inertials(Random& random, std::size_t num) {
  std::vector<Inertial> inertials;
  for (std::size_t i = 0; i < num; ++i) {
    inertials.push_back(random_inertial(random));
  }
  return inertials;
}

/// The robot with frames at the centres of mass, so that frame Jacobians are those of the bodies.
Robot with_frames_at_com(const Robot& robot, const std::vector<Inertial>& inertials) {
  std::vector<Frame> frames;
  for (int i = 0; i < robot.num_joints(); ++i) {
    Frame frame{"com" + std::to_string(i), i, Eigen::Isometry3d::Identity()};
    frame.X_JF.translation() = inertials[static_cast<std::size_t>(i)].com;
    frames.push_back(frame);
  }
  return Robot(robot.name(), robot.joints(), frames, robot.coordinate_names(), robot.limits());
}

}  // namespace

BOOST_AUTO_TEST_CASE(mass_matrix_and_bias_are_sums_over_bodies) {
  Random random(1);
  for (int trial = 0; trial < 100; ++trial) {
    const Robot tree = test::random_tree(random, random.integer(2, 9));
    const auto inertials = random_inertials(random, tree.joints().size());
    const Robot robot = with_frames_at_com(tree, inertials);
    const int nv = robot.num_coordinates();
    const Eigen::VectorXd q = random.vector(nv);
    const Eigen::VectorXd v = random.vector(nv);
    const Eigen::Vector3d gravity = random.vector(3);
    const RigidBodyDynamics dynamics(robot, inertials, gravity);
    RigidBodyDynamics::Workspace workspace(dynamics);
    Eigen::MatrixXd mass(nv, nv);
    Eigen::VectorXd force(nv);
    dynamics.mass_matrix(q, workspace, mass);
    dynamics.bias(q, v, workspace, force);

    KinematicState state(robot);
    state.update(robot, q, v);
    Eigen::MatrixXd expected_mass = Eigen::MatrixXd::Zero(nv, nv);
    Eigen::VectorXd expected_force = Eigen::VectorXd::Zero(nv);
    for (int i = 0; i < robot.num_joints(); ++i) {
      const Inertial& body = inertials[static_cast<std::size_t>(i)];
      const Eigen::MatrixXd J = frame_jacobian(robot, state, i);
      const Vector6d acceleration = frame_bias_acceleration(robot, state, i);
      const Eigen::Matrix3d R = state.link(i).R_WL;
      const Eigen::Matrix3d inertia = R * body.inertia * R.transpose();
      const Eigen::Vector3d omega = J.bottomRows(3) * v;
      expected_mass +=
          body.mass * J.topRows(3).transpose() * J.topRows(3) + J.bottomRows(3).transpose() * inertia * J.bottomRows(3);
      expected_force += J.topRows(3).transpose() * body.mass * (acceleration.head<3>() - gravity) +
                        J.bottomRows(3).transpose() * (inertia * acceleration.tail<3>() + omega.cross(inertia * omega));
    }
    BOOST_TEST((mass - expected_mass).cwiseAbs().maxCoeff() < tolerance);
    BOOST_TEST((force - expected_force).cwiseAbs().maxCoeff() < tolerance);

    Eigen::MatrixXd mass_of_state(nv, nv);
    Eigen::VectorXd force_of_state(nv);
    dynamics.mass_matrix(state, workspace, mass_of_state);
    dynamics.bias(state, workspace, force_of_state);
    BOOST_TEST((mass_of_state == mass));
    BOOST_TEST((force_of_state == force));

    // Gravity alone is the bias at rest, whatever velocity the state has.
    Eigen::VectorXd of_gravity(nv), at_rest(nv);
    dynamics.gravity(state, workspace, of_gravity);
    dynamics.bias(q, Eigen::VectorXd::Zero(nv), workspace, at_rest);
    BOOST_TEST((of_gravity - at_rest).cwiseAbs().maxCoeff() < tolerance);
    Eigen::VectorXd weight = Eigen::VectorXd::Zero(nv);
    for (int i = 0; i < robot.num_joints(); ++i) {
      weight -= frame_jacobian(robot, state, i).topRows(3).transpose() * inertials[static_cast<std::size_t>(i)].mass * gravity;
    }
    BOOST_TEST((of_gravity - weight).cwiseAbs().maxCoeff() < tolerance);
  }
}

BOOST_AUTO_TEST_CASE(kinetic_energy_changes_by_the_power_of_the_bias) {
  // Without gravity d/dt (v' M v / 2) = v' (M a + h) and a = 0 here, so v' h = v' dM/dt v / 2.
  Random random(2);
  const double h = 1e-5;  // truncation h^2, rounding 1e-15 / h
  for (int trial = 0; trial < 20; ++trial) {
    const Robot robot = test::random_tree(random, 7);
    const RigidBodyDynamics dynamics(robot, random_inertials(random, robot.joints().size()), Eigen::Vector3d::Zero());
    RigidBodyDynamics::Workspace workspace(dynamics);
    const int nv = robot.num_coordinates();
    const Eigen::VectorXd q = random.vector(nv), v = 0.3 * random.vector(nv);
    Eigen::MatrixXd before(nv, nv), after(nv, nv);
    Eigen::VectorXd force(nv);
    dynamics.mass_matrix(q - h * v, workspace, before);
    dynamics.mass_matrix(q + h * v, workspace, after);
    dynamics.bias(q, v, workspace, force);
    BOOST_TEST(std::abs(v.dot(force) - 0.25 / h * v.dot((after - before) * v)) < 1e-7);
  }
}

BOOST_AUTO_TEST_CASE(links_are_folded_onto_their_joints) {
  Random random(3);
  const Robot tree = test::random_tree(random, 5);
  std::vector<Frame> frames;
  for (int i = 0; i < 12; ++i) {
    frames.push_back({"link" + std::to_string(i), i % 6 - 1, test::random_pose(random, 0.3)});
  }
  const Robot robot(tree.name(), tree.joints(), frames, tree.coordinate_names(), tree.limits());
  const auto links = random_inertials(random, frames.size());
  const auto folded = fold_inertials(robot, links);
  BOOST_TEST(folded.size() == 5U);
  for (int joint = 0; joint < 5; ++joint) {
    const Inertial& body = folded[static_cast<std::size_t>(joint)];
    // Moments of a rigid body: mass, first moment, second moment, each the sum over its links.
    double mass = 0.0;
    Eigen::Vector3d first = Eigen::Vector3d::Zero();
    Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < links.size(); ++i) {
      if (frames[i].joint == joint) {
        const Eigen::Vector3d com = frames[i].X_JF * links[i].com;
        const Eigen::Matrix3d R = frames[i].X_JF.linear();
        mass += links[i].mass;
        first += links[i].mass * com;
        second += R * links[i].inertia * R.transpose() +
                  links[i].mass * (com.squaredNorm() * Eigen::Matrix3d::Identity() - com * com.transpose());
      }
    }
    const Eigen::Matrix3d about_origin =
        body.inertia + body.mass * (body.com.squaredNorm() * Eigen::Matrix3d::Identity() - body.com * body.com.transpose());
    BOOST_TEST(std::abs(body.mass - mass) < 1e-14);
    BOOST_TEST((body.mass * body.com - first).norm() < 1e-14);
    BOOST_TEST((about_origin - second).norm() < 1e-14);
  }
}

BOOST_AUTO_TEST_CASE(dynamics_allocate_nothing) {
  Random random(4);
  const Robot robot = test::random_tree(random, 8);
  const RigidBodyDynamics dynamics(robot, random_inertials(random, robot.joints().size()));
  RigidBodyDynamics::Workspace workspace(dynamics);
  const int nv = robot.num_coordinates();
  const Eigen::VectorXd q = random.vector(nv), v = random.vector(nv);
  Eigen::MatrixXd mass(nv, nv);
  Eigen::VectorXd force(nv);
  KinematicState state(robot);
  state.update(robot, q, v);
  BOOST_TEST(test::allocations_of([&] {
               dynamics.mass_matrix(q, workspace, mass);
               dynamics.bias(q, v, workspace, force);
               dynamics.gravity(state, workspace, force);
             }) == 0U);
}

BOOST_AUTO_TEST_CASE(point_masses_fold_to_valid_inertias) {
  // Rounding leaves inertias slightly below zero; they are valid all the same.
  Random random(5);
  const Robot robot = test::random_tree(random, 4);
  std::vector<Inertial> links(robot.frames().size());
  for (Inertial& link : links) {
    link.mass = 3.0;
    link.com = 10.0 * random.vector(3);
  }
  BOOST_CHECK_NO_THROW(RigidBodyDynamics(robot, fold_inertials(robot, links)));
}

BOOST_AUTO_TEST_CASE(wrong_inertias_are_refused) {
  Random random(6);
  const Robot robot = test::random_tree(random, 4);
  const auto good = random_inertials(random, robot.joints().size());
  const auto refuses = [&](auto change, const std::string& what) {
    auto inertials = good;
    change(inertials);
    BOOST_CHECK_EXCEPTION(RigidBodyDynamics(robot, inertials), std::invalid_argument,
                          [&](const auto& error) { return std::string(error.what()).find(what) != std::string::npos; });
  };
  refuses([](auto& all) { all.pop_back(); }, "4 joints and 3 inertias");
  refuses([](auto& all) { all[1].mass = -0.5; }, "inertia of joint 'joint1': mass is -0.5");
  refuses([](auto& all) { all[2].com[0] = std::nan(""); }, "'joint2': centre of mass must be finite");
  refuses([](auto& all) { all[0].inertia(0, 0) = -1.0; }, "'joint0': rotational inertia must be symmetric and positive");
  refuses([](auto& all) { all[0].inertia(0, 1) += 0.1; }, "'joint0': rotational inertia must be symmetric and positive");
  refuses([](auto& all) { all[0].inertia(2, 1) = std::nan(""); }, "'joint0': rotational inertia");
  BOOST_CHECK_THROW(RigidBodyDynamics(robot, good, {0.0, std::nan(""), 0.0}), std::invalid_argument);
}
