// Kinematics of states side by side, with every instruction set of this machine, against that of each state.
#include "sidestep/kinematics/kinematic_block.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>
#include <limits>

#include "sidestep/kinematics/instruction_set.hpp"
#include "sidestep/kinematics/kinematic_state.hpp"
#include "support/allocations.hpp"
#include "support/every_instruction_set.hpp"
#include "support/random_scene.hpp"

using namespace sidestep;
using test::Random;

namespace {

constexpr int numbers = 30;  // of a link that count, and
constexpr int rows = 31;     // that it has rows for

}  // namespace

BOOST_AUTO_TEST_CASE(states_side_by_side_have_the_numbers_of_each) {
  for (const InstructionSet set : test::EveryInstructionSet()) {
    BOOST_TEST_CONTEXT(name(set)) {
      Random random(21);
      for (int trial = 0; trial < 50; ++trial) {
        const Robot robot = test::random_tree(random, random.integer(1, 9));
        const int nv = robot.num_coordinates();
        Eigen::MatrixXd q = random.matrix(nv, block_states), v = random.matrix(nv, block_states);
        q(0, 2) = 3e5;  // where sines are taken one by one
        q(nv - 1, 5) = -1e7;
        std::vector<BlockRow> q_rows(static_cast<std::size_t>(nv)), v_rows(q_rows);
        for (int i = 0; i < nv; ++i) {
          for (int k = 0; k < block_states; ++k) {
            q_rows[static_cast<std::size_t>(i)].of[k] = q(i, k);
            v_rows[static_cast<std::size_t>(i)].of[k] = v(i, k);
          }
        }
        KinematicBlock block(robot);
        BOOST_TEST(test::allocations_of([&] { block.update(q_rows, v_rows); }) == 0);
        KinematicState state(robot);
        for (int k = 0; k < block_states; ++k) {
          state.update(robot, q.col(k), v.col(k));
          // Rounding; a fused multiple and offset of an angle of 1e7 rad differ by up to 1e-9 rad.
          const double tolerance = q.col(k).cwiseAbs().maxCoeff() > 1e3 ? 1e-8 : 1e-12;
          const double size = 1.0 + q.col(k).cwiseAbs().maxCoeff();  // sliding joints go as far
          for (int j = 0; j < state.num_links(); ++j) {
            for (int n = 0; n < numbers; ++n) {
              const double found = block.links()[(j * rows + n) * block_states + k], expected = state.link(j).numbers()[n];
              BOOST_TEST(std::abs(found - expected) <= tolerance * size * (1.0 + v.col(k).squaredNorm()));
            }
          }
        }
      }
    }
  }
}
