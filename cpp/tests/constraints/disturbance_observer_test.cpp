// The observer on plants whose disturbance and rotors are known.
#include "sidestep/constraints/disturbance_observer.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>
#include <numbers>
#include <random>

#include "support/allocations.hpp"
#include "support/numbers.hpp"

using namespace sidestep;

namespace {

constexpr double observer_period = 0.001;
constexpr double observer_time = 0.03, share = 0.8;

JointLimits limits_of_two() {
  JointLimits limits = JointLimits::unlimited(2);
  limits.effort << 50.0, 20.0;
  limits.acceleration << 10.0, 10.0;
  limits.velocity << 5.0, 5.0;
  return limits;
}

/// Two joints, (M + J) v̇ + h = τ + d, that are sent what the observer's model makes of a wanted acceleration.
struct Plant {
  Eigen::Matrix2d mass = (Eigen::Matrix2d() << 2.0, 0.4, 0.4, 0.5).finished();
  Eigen::Vector2d bias{3.0, -1.0}, rotors = Eigen::Vector2d::Zero(), disturbance = Eigen::Vector2d::Zero(),
                                   friction = Eigen::Vector2d::Zero();
  Eigen::Matrix2d payload = Eigen::Matrix2d::Zero();
  double noise = 0.0;  // [rad/s] of measured velocities, uniform
  Eigen::VectorXd v = Eigen::Vector2d::Zero(), measured = Eigen::Vector2d::Zero();
  std::mt19937 random{7};

  void step(DisturbanceObserver& observer, const Eigen::Vector2d& wanted) {
    Eigen::Matrix2d known = mass;
    known.diagonal() += observer.rotors();
    const Eigen::VectorXd torque = known * wanted + bias - observer.disturbance();
    Eigen::Matrix2d real = mass + payload;
    real.diagonal() += rotors;
    const Eigen::Vector2d dry = -friction.cwiseProduct((v / 1e-3).array().tanh().matrix());
    const Eigen::VectorXd before = measured;
    v += observer_period * real.ldlt().solve(torque + disturbance + dry - bias);
    std::uniform_real_distribution<double> error(-noise, noise);
    measured = v + Eigen::Vector2d(error(random), error(random));
    const Eigen::VectorXd predicted = wanted;
    observer.update({before, measured, torque, predicted, observer_period}, mass, bias);
  }
};

/// There and back, at 4 Hz and 7 Hz: swings between velocities of one sign are long enough to count.
Eigen::Vector2d swing(int k, double mean) {
  using std::numbers::pi;
  const double t = k * observer_period;
  // around a slow motion there and back
  const double slow = mean * 2.0 * pi * 0.3 * std::cos(2.0 * pi * 0.3 * t);
  return {slow + 8.0 * std::cos(2.0 * pi * 4.0 * t), slow + 8.0 * std::cos(2.0 * pi * 7.0 * t)};
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_motion_counts_for_as_long_as_it_took) {
  DisturbanceObserver observer(limits_of_two(), observer_time, share);
  const Eigen::MatrixXd mass = Eigen::Matrix2d::Identity();
  const Eigen::VectorXd rest = Eigen::Vector2d::Zero(), after = Eigen::Vector2d(0.004, 0.0);  // 1 rad/s² for 4 ms
  observer.update({rest, after, rest, rest, 0.004}, mass, rest);
  BOOST_TEST(std::abs(observer.disturbance()[0] - 0.004 / observer_time) < 1e-12);
}

BOOST_AUTO_TEST_CASE(a_constant_disturbance_is_found_with_the_time_constant) {
  DisturbanceObserver observer(limits_of_two(), observer_time, share);
  Plant plant;
  plant.disturbance << -6.0, 2.0;
  for (int k = 0; k < 30; ++k) {  // T_o
    plant.step(observer, Eigen::Vector2d::Zero());
  }
  const double left = std::pow(1.0 - observer_period / observer_time, 30);  // 0.362: of held samples, 1/e in the limit
  BOOST_TEST((observer.disturbance() - (1.0 - left) * plant.disturbance).cwiseAbs().maxCoeff() < 1e-9);
  for (int k = 0; k < 300; ++k) {
    plant.step(observer, Eigen::Vector2d::Zero());
  }
  BOOST_TEST((observer.disturbance() - plant.disturbance).cwiseAbs().maxCoeff() < 1e-3);  // e^-11 of 6 Nm
  const Eigen::VectorXd v = plant.v;
  for (int k = 0; k < 100; ++k) {
    plant.step(observer, Eigen::Vector2d::Zero());
  }
  BOOST_TEST((plant.v - v).cwiseAbs().maxCoeff() < 1e-4);  // it moves on as it is told
}

BOOST_AUTO_TEST_CASE(a_disturbance_is_bounded_by_its_share_of_the_effort_limits) {
  DisturbanceObserver observer(limits_of_two(), observer_time, share);
  Plant plant;
  plant.disturbance << -500.0, 500.0;
  for (int k = 0; k < 500; ++k) {
    plant.step(observer, Eigen::Vector2d::Zero());
  }
  BOOST_TEST(observer.disturbance()[0] == -share * 50.0);
  BOOST_TEST(observer.disturbance()[1] == share * 20.0);
}

BOOST_AUTO_TEST_CASE(a_leap_of_the_velocity_is_not_a_disturbance) {
  // As by an impact, or where a simulation starts anew: 1 rad/s within a period would be a force of 2,000 Nm.
  DisturbanceObserver observer(limits_of_two(), observer_time, share);
  Plant plant;
  plant.disturbance << -6.0, 2.0;
  for (int k = 0; k < 3000; ++k) {
    if (k % 500 == 400) {
      plant.v[0] += k % 1000 < 500 ? 1.0 : -1.0;
    }
    plant.step(observer, swing(k, 2.0));
    if (k > 300) {
      BOOST_REQUIRE((observer.disturbance() - plant.disturbance).cwiseAbs().maxCoeff() < 0.01);
    }
  }
  BOOST_TEST(observer.rotors().cwiseAbs().maxCoeff() < 1e-3);
}

BOOST_AUTO_TEST_CASE(what_holds_a_light_joint_is_found) {
  // What is predicted then is a leap, in every period.
  DisturbanceObserver observer(limits_of_two(), observer_time, share);
  const Eigen::MatrixXd mass = Eigen::Matrix2d::Identity() * 0.01;
  const Eigen::VectorXd none = Eigen::Vector2d::Zero(), torque = Eigen::Vector2d(8.0, 0.0);
  for (int k = 0; k < 500; ++k) {  // at rest: 8 Nm and a disturbance of -8 Nm
    const Eigen::VectorXd predicted = (torque + observer.disturbance()) / 0.01;
    observer.update({none, none, torque, predicted, observer_period}, mass, none);
  }
  BOOST_TEST(observer.disturbance()[0] == -8.0, boost::test_tools::tolerance(1e-3));
  BOOST_TEST(observer.disturbance()[1] == 0.0);
}

BOOST_AUTO_TEST_CASE(rotors_are_found_where_there_are_some) {
  for (const double rotor : {0.0, 0.1}) {
    DisturbanceObserver observer(limits_of_two(), observer_time, share);
    Plant plant;
    plant.rotors << 0.0, rotor;
    plant.disturbance << 1.0, -0.5;
    for (int k = 0; k < 6000; ++k) {
      plant.step(observer, swing(k, 2.0));
    }
    BOOST_TEST(std::abs(observer.rotors()[0]) < 0.01);
    BOOST_TEST(std::abs(observer.rotors()[1] - rotor) < 0.1 * rotor + 1e-3);  // the guess of none counts for a few percent
  }
}

BOOST_AUTO_TEST_CASE(dry_friction_is_not_taken_for_inertia) {
  DisturbanceObserver observer(limits_of_two(), observer_time, share);
  Plant plant;
  plant.friction << 4.0, 2.0;
  for (int k = 0; k < 6000; ++k) {  // turns back twice in every swing
    plant.step(observer, swing(k, 2.0));
  }
  BOOST_TEST(observer.rotors()[0] < 0.02);  // [kg m²] of 2
  BOOST_TEST(observer.rotors()[1] < 0.02);
}

BOOST_AUTO_TEST_CASE(a_payload_is_not_taken_for_rotors) {
  DisturbanceObserver observer(limits_of_two(), observer_time, share);
  Plant plant;
  plant.payload << 0.6, 0.35, 0.35, 0.22;
  for (int k = 0; k < 6000; ++k) {
    plant.step(observer, swing(k, 2.0));
  }
  BOOST_TEST(observer.rotors()[0] < 0.06);  // [kg m²]: a tenth of what the payload adds
  BOOST_TEST(observer.rotors()[1] < 0.022);
}

BOOST_AUTO_TEST_CASE(rotors_are_found_beside_friction_and_noise) {
  DisturbanceObserver observer(limits_of_two(), observer_time, share);
  Plant plant;
  plant.rotors << 0.0, 0.1;
  plant.friction << 1.0, 1.0;
  plant.noise = 0.01;
  for (int k = 0; k < 6000; ++k) {
    plant.step(observer, swing(k, 2.0));
  }
  BOOST_TEST(observer.rotors()[0] < 0.05);
  BOOST_TEST(std::abs(observer.rotors()[1] - 0.1) < 0.02);
  for (int k = 0; k < 60000; ++k) {  // at rest nothing is learnt or forgotten
    plant.step(observer, Eigen::Vector2d::Zero());
  }
  BOOST_TEST(std::abs(observer.rotors()[1] - 0.1) < 0.02);
}

BOOST_AUTO_TEST_CASE(what_is_not_finite_changes_nothing_and_no_update_allocates) {
  DisturbanceObserver observer(limits_of_two(), observer_time, share);
  Plant plant;
  plant.disturbance << 2.0, 1.0;
  for (int k = 0; k < 100; ++k) {
    plant.step(observer, swing(k, 1.0));
  }
  const Eigen::VectorXd disturbance = observer.disturbance(), rotors = observer.rotors();
  const Eigen::VectorXd good = Eigen::Vector2d(0.1, 0.2), bad = Eigen::Vector2d::Constant(test::not_a_number);
  const Eigen::MatrixXd mass = plant.mass, unknown = Eigen::Matrix2d::Constant(test::not_a_number);
  BOOST_TEST(test::allocations_of([&] {
               observer.update({good, bad, good, good, observer_period}, mass, good);
               observer.update({good, good, bad, good, observer_period}, mass, good);
               observer.update({good, good, good, bad, observer_period}, mass, good);
               observer.update({good, good, good, good, observer_period}, unknown, good);
               observer.update({good, good, good, good, observer_period}, mass, bad);
             }) == 0u);
  BOOST_TEST((observer.rotors() == rotors));
  BOOST_TEST((observer.disturbance() == disturbance));
  BOOST_TEST(test::allocations_of([&] { observer.update({good, good, good, good, observer_period}, mass, good); }) == 0u);
  BOOST_TEST((observer.disturbance() != disturbance));
}
