// One motion, as C++ makes it: `motion ARM.arm acceleration|torque STEPS PERIOD SEED` reads numbers: start and goal (nv),
// then centre, radius and velocity of each ball. It prints acceleration and torque (nv, nv) of every step in hexadecimal.
#include <limits>
#include <cstdio>
#include <iostream>
#include <sidestep/sidestep.hpp>
#include <string>
#include <vector>

int main(int, char** argv) {
  sidestep::ControllerSettings settings;
  settings.synchronous = true;
  settings.output = argv[2] == std::string("torque") ? sidestep::ControllerSettings::Output::torque
                                                     : sidestep::ControllerSettings::Output::acceleration;
  settings.period = std::stod(argv[4]);
  settings.seed = std::stoull(argv[5]);
  sidestep::Controller controller(sidestep::Arm::load(argv[1]), settings);

  std::vector<double> numbers;
  for (std::string word; std::cin >> word;) {
    numbers.push_back(std::stod(word));
  }
  const Eigen::Index nv = controller.arm().num_coordinates();
  const Eigen::Map<const Eigen::VectorXd> states(numbers.data(), 2 * nv);
  const Eigen::Map<const Eigen::Matrix<double, 7, Eigen::Dynamic>> balls(
      numbers.data() + 2 * nv, 7, (static_cast<Eigen::Index>(numbers.size()) - 2 * nv) / 7);
  Eigen::VectorXd q = states.head(nv), v = Eigen::VectorXd::Zero(nv);
  controller.set_goal(Eigen::VectorXd(states.tail(nv)));
  controller.set_obstacles({balls.topRows<3>(), balls.row(3).transpose(), balls.bottomRows<3>()},
                           {.valid_for = std::numeric_limits<double>::infinity()});

  for (int k = 0; k < std::stoi(argv[3]); ++k) {
    const sidestep::Command& command = controller.step(q, v);
    for (const Eigen::VectorXd* values : {&command.acceleration, &command.torque}) {
      for (const double value : *values) {
        std::printf("%a ", value);
      }
    }
    std::printf("\n");
    v = command.velocity;
    q = command.position;
  }
}
