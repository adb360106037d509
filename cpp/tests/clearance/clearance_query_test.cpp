// Clearances against those of the barriers' field, and edges against a dense scan.
#include "sidestep/clearance/clearance_query.hpp"

#include <Eigen/Eigenvalues>
#include <boost/test/unit_test.hpp>
#include <limits>

#include "sidestep/attractor/clearance_barrier.hpp"
#include "sidestep/math/instruction_set.hpp"
#include "support/allocations.hpp"
#include "support/every_instruction_set.hpp"
#include "support/random_scene.hpp"

using namespace sidestep;
using test::Random;

namespace {

Body calibrated(Random& random, const Robot& robot, double size) {
  Body body = test::random_body(random, robot);
  for (Eigen::Matrix3d& covariance : body.covariances) {
    covariance *= size;
  }
  return Body(body.links, body.weights, body.means, body.covariances, Eigen::VectorXd::Ones(body.num_components()));
}

const Margins none{0.0, 0.002, 0.3, {}};

/// Signed, by bisection of the secular equation |a_i e_i / (a_i² + t)| = 1.
double distance_to_ellipsoid(const Eigen::Vector3d& offset, const Eigen::Matrix3d& shape) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(shape);
  const Eigen::Array3d e = (eigen.eigenvectors().transpose() * offset).array(), squares = eigen.eigenvalues().array();
  double low = -squares[0], high = std::sqrt((squares * e.square()).sum());
  for (int i = 0; i < 200; ++i) {
    const double t = 0.5 * (low + high);
    (squares * (e / (squares + t)).square()).sum() > 1.0 ? low = t : high = t;
  }
  return high * (e / (squares + high)).matrix().norm();
}

}  // namespace

BOOST_AUTO_TEST_CASE(agrees_with_the_barriers_clearances) {
  Random random(1);
  for (int trial = 0; trial < 60; ++trial) {
    const Robot robot = test::random_tree(random, 6);
    const Body body = calibrated(random, robot, 0.05);
    const std::vector<LinkPair> pairs{{"link0", "link5"}, {"link1", "link4", -0.03}};
    const KeptPlane plane{Eigen::Vector3d(0.0, 0.0, -1.0), Eigen::Vector3d(0.1, 0.2, 1.0), {"link3", "link5"}};
    const ClearanceQuery checked(robot, body, pairs, {plane});
    ClearanceQuery::Workspace w(checked);
    const Obstacles obstacles(2.0 * random.matrix(3, 40), Eigen::VectorXd::Constant(40, 0.01), Eigen::Matrix3Xd::Zero(3, 40));
    const Eigen::VectorXd q = random.vector(robot.num_coordinates()).cwiseMax(-3.0).cwiseMin(3.0);
    Eigen::VectorXd found(checked.num_items());
    constexpr double cap = 5.0;
    checked.clearances(q, obstacles, cap, w, found);

    // A temperature so low that the mean over points is their least, but for rounding of exponentials.
    constexpr double cold = 1e-6;
    const BarrierFunction f{cap, 1.0, 2.0, 0.002};
    const Eigen::VectorXd rest = Eigen::VectorXd::Zero(robot.num_coordinates());
    const auto by_link = [&](const Embedding& e, CoordinateLabel::Kind kind, bool below) {
      const EmbeddingEvaluation values = evaluate(e, q, rest, obstacles);
      for (int i = 0; i < checked.num_items(); ++i) {
        if (checked.label(i).kind != kind) {
          continue;
        }
        double least = cap;
        for (int k = 0; k < e.num_coordinates(); ++k) {
          if (e.label(k).name == checked.label(i).name && e.label(k).other == checked.label(i).other) {
            least = std::min(least, values.clearances.values[k]);
          }
        }
        if (!below) {
          BOOST_TEST(std::abs(found[i] - least) < 1e-5);  // the mean lies above the least by less than the temperature
        } else if (least > 0.0) {
          BOOST_TEST(found[i] <= least + 1e-5);
          BOOST_TEST(1.5 * found[i] >= least - 1e-5);  // random ellipsoids may be needles, of which it misses a part
        }
      }
    };
    by_link(SelfCollisionBarrier(robot, body, pairs, f, cold), CoordinateLabel::Kind::self, false);
    by_link(PlaneBarrier(robot, body, plane, f, cold), CoordinateLabel::Kind::plane, false);
    // The field's clearance of points outside is their distance.
    by_link(ClearanceBarrier(robot, body, f, cold), CoordinateLabel::Kind::obstacle, true);
    BOOST_TEST(std::abs(checked.nearest(q, obstacles, cap, w).clearance - found.minCoeff()) < 1e-12);  // rounding
    const double obstacle = found.head(checked.items().num_obstacles()).minCoeff();
    BOOST_TEST(std::abs(checked.nearest_obstacle(q, obstacles, cap, w).clearance - obstacle) < 1e-12);  // rounding
    BOOST_TEST(checked.free(q, obstacles, none, w) == (found.minCoeff() >= 0.0));
  }
}

BOOST_AUTO_TEST_CASE(clearances_of_points_are_distances_from_ellipsoids) {
  Random random(6);
  for (const InstructionSet set : test::EveryInstructionSet()) {
    BOOST_TEST_INFO_SCOPE(name(set));
    for (int trial = 0; trial < 100; ++trial) {
      const Robot robot = test::random_tree(random, 2);
      Body body = calibrated(random, robot, 1.0);
      for (Eigen::Matrix3d& covariance : body.covariances) {  // up to 1 : 4
        const Eigen::Matrix3d turn = Eigen::Quaterniond(Eigen::Vector4d(random.matrix(4, 1))).normalized().toRotationMatrix();
        const Eigen::Vector3d semi_axes(random.magnitude(0.05, 0.2), random.magnitude(0.05, 0.2), random.magnitude(0.05, 0.2));
        covariance = turn * semi_axes.cwiseAbs2().asDiagonal() * turn.transpose();
      }
      body = Body(body.links, body.weights, body.means, body.covariances, Eigen::VectorXd::Ones(body.num_components()));
      const ClearanceQuery checked(robot, body);
      ClearanceQuery::Workspace w(checked);
      const int num = random.integer(1, 400);
      const double spread = random.magnitude(0.05, 3.0);
      const Obstacles obstacles(spread * random.matrix(3, num), 0.01 * random.vector(num).cwiseAbs(),
                                Eigen::Matrix3Xd::Zero(3, num));
      const Eigen::VectorXd q = random.vector(robot.num_coordinates()).cwiseMax(-3.0).cwiseMin(3.0);
      KinematicState state(robot);
      state.update(robot, q, Eigen::VectorXd::Zero(robot.num_coordinates()));
      double least = 20.0;
      for (int k = 0; k < body.num_components(); ++k) {
        const int frame = robot.frame_index(body.links[static_cast<std::size_t>(k)]);
        if (robot.frames()[static_cast<std::size_t>(frame)].joint < 0) {
          continue;
        }
        const Eigen::Isometry3d X = frame_pose(robot, state, frame);
        for (int n = 0; n < num; ++n) {
          const double distance =
              distance_to_ellipsoid(X.inverse() * Eigen::Vector3d(obstacles.points().col(n)) - body.means.col(k),
                                    body.covariances[static_cast<std::size_t>(k)]) -
              obstacles.radii()[n];
          least = std::min(least, distance);
        }
      }
      const ClearanceQuery::Nearest found = checked.nearest(q, obstacles, 20.0, w);
      BOOST_TEST(found.clearance <= least + 1e-5);  // single precision at some metres
      if (least > 0.0) {
        // two steps of Newton leave less than 1 % for such axes
        BOOST_TEST(found.clearance >= 0.99 * least - 0.01 * 0.01);
      }
      BOOST_TEST(checked.nearest(q, obstacles, found.clearance, w).point == -1);  // nothing is nearer
    }
  }
}

BOOST_AUTO_TEST_CASE(no_point_moves_farther_than_the_bound) {
  Random random(2);
  int smaller = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const Robot robot = test::random_tree(random, 6);
    const Body body = calibrated(random, robot, 0.05);
    const ClearanceQuery checked(robot, body);
    ClearanceQuery::Workspace w(checked);
    const int nv = robot.num_coordinates();
    const Eigen::VectorXd a = random.vector(nv).cwiseMax(-3.0).cwiseMin(3.0);
    const Eigen::VectorXd b = (a + 0.2 * random.vector(nv)).cwiseMax(-3.0).cwiseMin(3.0);
    const Obstacles obstacles(2.0 * random.matrix(3, 3), Eigen::VectorXd::Zero(3), Eigen::Matrix3Xd::Zero(3, 3));
    Eigen::VectorXd at_a(checked.num_items()), at_b(checked.num_items());
    checked.clearances(a, obstacles, 10.0, w, at_a);
    checked.clearances(b, obstacles, 10.0, w, at_b);
    for (int i = 0; i < checked.num_items(); ++i) {
      if (at_a[i] > 0.0) {  // a signed lower bound may change faster inside
        // at_a is a lower bound of the distance: random ellipsoids may be needles, of which it misses a part
        BOOST_TEST(at_b[i] <= 1e-5 + checked.motion(i, b - a) + 1.5 * at_a[i]);
      }
    }
    // The bound itself, by points on the ellipsoids.
    KinematicState state_a(robot), state_b(robot);
    state_a.update(robot, a, Eigen::VectorXd::Zero(nv));
    state_b.update(robot, b, Eigen::VectorXd::Zero(nv));
    for (int i = 0; i < checked.num_items(); ++i) {
      const int frame = robot.frame_index(checked.label(i).name);
      for (int k = 0; k < body.num_components(); ++k) {
        if (body.links[static_cast<std::size_t>(k)] == checked.label(i).name) {
          const Eigen::Matrix3d& S = body.covariances[static_cast<std::size_t>(k)];
          const Eigen::Vector3d n = random.matrix(3, 1);
          const Eigen::Vector3d x = body.means.col(k) + S * n / std::sqrt(n.dot(S * n));
          const Eigen::Vector3d moved = frame_pose(robot, state_b, frame) * x - frame_pose(robot, state_a, frame) * x;
          BOOST_TEST(moved.norm() <= checked.motion(i, b - a) + 1e-12);  // rounding
          const double nearer = checked.motion(i, a, b - a, w);
          BOOST_TEST(moved.norm() <= nearer + 1e-12);
          BOOST_TEST(nearer <= checked.motion(i, b - a) + 1e-12);  // summed in another order
          smaller += nearer < 0.5 * checked.motion(i, b - a);
        }
      }
    }
  }
  BOOST_TEST(smaller > 100);
}

BOOST_AUTO_TEST_CASE(an_edge_that_is_free_has_no_gap) {
  Random random(3);
  int free = 0, blocked = 0, thin = 0, half = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const Robot robot = test::random_tree(random, 5);
    const ClearanceQuery checked(robot, calibrated(random, robot, 0.01), {{"link0", "link4"}});
    ClearanceQuery::Workspace w(checked);
    const int nv = robot.num_coordinates();
    const Eigen::VectorXd a = random.vector(nv).cwiseMax(-3.0).cwiseMin(3.0);
    const Eigen::VectorXd b = random.vector(nv).cwiseMax(-3.0).cwiseMin(3.0);
    const int num = random.integer(1, 60);
    const Obstacles obstacles(0.7 * random.matrix(3, num), Eigen::VectorXd::Zero(num), Eigen::Matrix3Xd::Zero(3, num));
    const Margins margins{0.01, 0.002, 0.3, {}};
    double least = std::numeric_limits<double>::infinity();
    int below = 0;
    constexpr int samples = 2000;
    for (int k = 0; k <= samples; ++k) {
      const Eigen::VectorXd q = a + (b - a) * k / samples;
      const double clearance = checked.nearest(q, obstacles, 1.0, w).clearance;
      below += clearance < margins.margin - margins.slack;
      least = std::min(least, clearance);
    }
    const bool said = checked.edge_free(a, b, obstacles, margins, w), on = checked.edge_free(b, -a, obstacles, margins, w);
    BOOST_TEST(checked.path_free({a, b, -a}, obstacles, margins, w) == (said && on));
    half += said != on;
    if (said) {
      ++free;
      BOOST_TEST(least >= margins.margin - margins.slack);
    } else {
      ++blocked;
      thin += below > 0 && below < samples / 50;
      // what is refused comes nearer than the margin somewhere, and a scan this fine comes as near within its step
      BOOST_TEST(least < margins.margin + checked.reach().dot((b - a).cwiseAbs()) / samples);
    }
  }
  BOOST_TEST(free > 30);
  BOOST_TEST(blocked > 30);
  BOOST_TEST(half > 30);  // paths of which one edge is free
  BOOST_TEST(thin > 3);   // obstacles that samples 50 times coarser would have stepped over
}

BOOST_AUTO_TEST_CASE(an_edge_through_a_table_has_no_gap) {
  Random random(8);
  int free = 0, refused = 0, beyond = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const Robot robot = test::random_tree(random, 6);
    const Body body = calibrated(random, robot, 0.01);
    const int nv = robot.num_coordinates();
    if (nv < 2) {
      continue;
    }
    PairDistanceTable table{
        "link0", "link3", {PairDistanceTable::Axis{0, -3.0, 0.5, false}, {nv - 1, -M_PI, M_PI / 4.0, true}}, {}};
    table.control = 0.03 * random.matrix(13, 8);
    const ClearanceQuery checked(robot, body, {}, {}, {table});
    ClearanceQuery::Workspace w(checked);
    const int item = checked.num_items() - 1;
    BOOST_TEST(checked.label(item).name == "link0");
    const Eigen::VectorXd a = random.vector(nv), b = a + 0.5 * random.vector(nv);
    const Margins margins{0.002, 0.002, 0.3, {}, 0.002};
    const bool edge = checked.edge_free(a, b, Obstacles::none(), margins, w);
    double least = std::numeric_limits<double>::infinity();
    for (int i = 0; i <= 400; ++i) {
      const Eigen::VectorXd q = a + i / 400.0 * (b - a);
      const double exact = table.at(q[0], q[nv - 1]).value;
      BOOST_TEST(checked.nearest(item, q, Obstacles::none(), 1.0, w).clearance == exact);
      least = std::min(least, exact);
      beyond += std::abs(exact - table.at(a[0], a[nv - 1]).value) > checked.motion(item, q - a) + 1e-12;  // rounding
    }
    edge ? ++free : ++refused;
    if (edge) {
      BOOST_TEST(least >= 0.0);  // margin less slack
    } else {
      BOOST_TEST(least < 0.002 + 1e-6);  // a scan sees the least to second order of its spacing
    }
  }
  BOOST_TEST(beyond == 0);
  BOOST_TEST(std::min(free, refused) > 50);  // so that both say something
}

BOOST_AUTO_TEST_CASE(an_edge_keeps_margins_that_ease_at_its_ends) {
  Random random(8);
  int free = 0, blocked = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const Robot robot = test::random_tree(random, 4);
    const ClearanceQuery checked(robot, calibrated(random, robot, 0.01));
    ClearanceQuery::Workspace w(checked);
    const int nv = robot.num_coordinates();
    const Eigen::VectorXd a = random.vector(nv).cwiseMax(-3.0).cwiseMin(3.0);
    const Eigen::VectorXd b = (a + 0.3 * random.vector(nv)).cwiseMax(-3.0).cwiseMin(3.0);
    const int num = random.integer(10, 100);
    const Obstacles obstacles(0.5 * random.matrix(3, num), Eigen::VectorXd::Zero(num), Eigen::Matrix3Xd::Zero(3, num));
    Margins margins{0.03, 0.002, 0.3, {}};
    Eigen::VectorXd clearances(checked.num_items());
    for (const Eigen::VectorXd* q : {&a, &b}) {
      checked.clearances(*q, obstacles, margins.margin, w, clearances);
      margins.ends.push_back({*q, (margins.margin + 1e-6 - clearances.array()).max(0.0)});
    }
    const bool said = checked.edge_free(a, b, obstacles, margins, w);
    double least = std::numeric_limits<double>::infinity();  // beyond what is asked
    constexpr int samples = 500;
    for (int k = 0; k <= samples; ++k) {
      const Eigen::VectorXd q = a + (b - a) * k / samples;
      checked.clearances(q, obstacles, 1.0, w, clearances);
      for (int i = 0; i < checked.num_items(); ++i) {
        double lowered = 0.0;
        for (const Margins::End& end : margins.ends) {
          lowered = std::max(lowered, end.deficits[i] * std::max(0.0, 1.0 - checked.motion(i, q - end.q) / margins.fade));
        }
        least = std::min(least, clearances[i] - (margins.margin - lowered));
      }
    }
    if (said) {
      ++free;
      BOOST_TEST(least >= -margins.slack - 1e-5);  // single precision
    } else {
      ++blocked;
      // within a sample something comes no nearer than it and the margin move, the latter by the slope of 0.1 and more
      BOOST_TEST(least < 5.0 * checked.reach().dot((b - a).cwiseAbs()) / samples);
    }
  }
  BOOST_TEST(free > 30);
  BOOST_TEST(blocked > 30);
}

BOOST_AUTO_TEST_CASE(margins_ease_at_an_end_and_only_there) {
  Random random(4);
  const Robot robot = test::random_tree(random, 4);
  const ClearanceQuery checked(robot, calibrated(random, robot, 0.02));
  ClearanceQuery::Workspace w(checked);
  const Eigen::VectorXd q = Eigen::VectorXd::Constant(robot.num_coordinates(), 0.3);
  const Obstacles obstacles(random.matrix(3, 1), Eigen::VectorXd::Zero(1), Eigen::Matrix3Xd::Zero(3, 1));
  const double clearance = checked.nearest(q, obstacles, 10.0, w).clearance;
  Margins margins{clearance + 0.01, 0.002, 0.3, {}};
  BOOST_TEST(!checked.free(q, obstacles, margins, w));
  margins.ends = {{q, Eigen::VectorXd::Constant(checked.num_items(), 0.0101)}};
  BOOST_TEST(checked.free(q, obstacles, margins, w));
  margins.ends[0].q.array() += 1.0;  // far away: nothing is eased
  BOOST_TEST(!checked.free(q, obstacles, margins, w));
}

BOOST_AUTO_TEST_CASE(queries_allocate_nothing) {
  Random random(5);
  const Robot robot = test::random_tree(random, 6);
  const ClearanceQuery checked(robot, calibrated(random, robot, 0.02), {{"link0", "link5"}});
  ClearanceQuery::Workspace w(checked);
  const Obstacles obstacles = test::random_obstacles(random, 50);
  const Eigen::VectorXd a = random.vector(robot.num_coordinates()), b = -a;
  int answers = 0;
  const std::size_t allocations = test::allocations_of([&] {
    answers += checked.free(a, obstacles, none, w) + checked.edge_free(a, b, obstacles, none, w);
    answers += checked.nearest(a, obstacles, 1.0, w).item >= 0;
  });
  BOOST_TEST(answers >= 0);
  BOOST_TEST(allocations == 0);
}

BOOST_AUTO_TEST_CASE(links_far_apart_are_free_whatever_their_contact) {
  Random random(7);
  const Robot robot = test::random_tree(random, 4);
  Body body = calibrated(random, robot, 1.0);
  for (Eigen::Matrix3d& covariance : body.covariances) {
    covariance = 1e-6 * Eigen::Matrix3d::Identity();
  }
  body = Body(body.links, body.weights, body.means, body.covariances, Eigen::VectorXd::Ones(body.num_components()));
  const int nv = robot.num_coordinates();
  const Eigen::VectorXd q = Eigen::VectorXd::Zero(nv), b = Eigen::VectorXd::Constant(nv, 1e-3);
  for (int trial = 0; trial < 200; ++trial) {
    const ClearanceQuery checked(robot, body, {{body.links.front(), body.links.back(), random.uniform(-0.08, -0.001)}});
    ClearanceQuery::Workspace w(checked);
    for (const double margin : {0.005, 0.0025, 0.02}) {
      const Margins margins{margin, 0.002, 0.3, {}};
      BOOST_TEST(checked.free(q, Obstacles::none(), margins, w));
      BOOST_TEST(checked.edge_free(q, b, Obstacles::none(), margins, w));
    }
    BOOST_TEST(checked.nearest(q, Obstacles::none(), 0.01, w).item == -1);
  }
}

BOOST_AUTO_TEST_CASE(what_moves_is_nearer_than_it_is_said_to_be) {
  Random random(5);
  const Robot robot = test::random_tree(random, 6);
  const ClearanceQuery body(robot, calibrated(random, robot, 0.05));
  ClearanceQuery::Workspace w(body);
  constexpr double far = 10.0, time = 0.5, speed = 0.4;
  for (int trial = 0; trial < 200; ++trial) {
    const Eigen::VectorXd q = random.vector(robot.num_coordinates()).cwiseMax(-3.0).cwiseMin(3.0);
    const Eigen::Matrix3Xd points = 2.0 * random.matrix(3, 2);
    const Eigen::VectorXd radii = Eigen::Vector2d(0.1, 0.2);
    Eigen::Matrix3Xd velocities = Eigen::Matrix3Xd::Zero(3, 2);
    BOOST_TEST(body.nearest_moving(q, Obstacles(points, radii, velocities), time, w) ==
               std::numeric_limits<double>::infinity());
    velocities(1, 1) = speed;
    const Obstacles obstacles(points, radii, velocities);
    const double distance =
        body.nearest(q, Obstacles(points.rightCols(1), radii.tail(1), Eigen::Matrix3Xd::Zero(3, 1)), far, w).clearance;
    double found = 0.0;
    BOOST_TEST(test::allocations_of([&] { found = body.nearest_moving(q, obstacles, time, w); }) == 0);
    BOOST_TEST(found <= distance - time * speed + 1e-6);  // rounding of distances in single precision
    // Not nearer than the far sides of the balls around the links are.
    BOOST_TEST(found == body.nearest_moving(q, obstacles, 0.0, w) - time * speed, boost::test_tools::tolerance(1e-12));
  }
}

BOOST_AUTO_TEST_CASE(distance_left_is_what_the_least_clearance_has_beyond_its_floor) {
  Random random(11);
  for (int trial = 0; trial < 60; ++trial) {
    const Robot robot = test::random_tree(random, 6);
    const ClearanceQuery checked(robot, calibrated(random, robot, 0.05), {{"link0", "link5"}, {"link1", "link4", -0.03}});
    ClearanceQuery::Workspace w(checked);
    const Obstacles obstacles(2.0 * random.matrix(3, 40), Eigen::VectorXd::Constant(40, 0.01), Eigen::Matrix3Xd::Zero(3, 40));
    const Eigen::VectorXd q = random.vector(robot.num_coordinates()).cwiseMax(-3.0).cwiseMin(3.0);
    const Eigen::VectorXd floors = 0.05 * random.vector(checked.num_items());
    Eigen::VectorXd clearances(checked.num_items());
    constexpr double cap = 0.5, far = 1.0;  // the distance left is never more than the cap, whatever the floors
    checked.clearances(q, obstacles, far, w, clearances);
    const double least = std::min(cap, (clearances - floors).minCoeff());
    const double distance_left = checked.distance_left(q, obstacles, floors, cap, cap, w);
    if (least >= 0.0) {
      BOOST_TEST(std::abs(distance_left - least) < 1e-12);
    } else {
      BOOST_TEST(distance_left < 0.0);
    }
    constexpr double near = 0.05;
    const double rough = checked.distance_left(q, obstacles, floors, near, cap, w);
    BOOST_TEST(rough <= distance_left + 1e-12);
    BOOST_TEST((rough >= near || std::abs(rough - distance_left) < 1e-12 || distance_left < 0.0));
  }
}
