// Black boxes as files: what the thread of a recorder gives them, without a controller.
#include <boost/test/unit_test.hpp>
#include <sys/resource.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <system_error>
#include <vector>

#include "../../src/controller/black_box.hpp"
#include "sidestep/controller/recorded_run.hpp"
#include "support/covered_arm.hpp"
#include "support/numbers.hpp"

using namespace sidestep;
using recording::RecordKind;
using test::covered_arm;
using test::nv;

namespace {

constexpr std::uint64_t least_bytes = std::uint64_t{1} << 20;  // Least size of a black box that is allowed [B].
constexpr double box_period = 0.01;                            // [s]

/// A folder that no other program has, removed at the end.
struct BoxFolder {
  std::filesystem::path path = std::filesystem::temp_directory_path() / ("sidestep-" + std::to_string(std::random_device{}()));
  ~BoxFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
};

/// A black box and what is written to it.
struct WrittenBox {
  explicit WrittenBox(const std::filesystem::path& folder, double seconds = 100.0)
      : box(folder, "covered_arm", nv, seconds, least_bytes) {
    recording::HeadRecord head;
    head.arm_file = recording::arm_bytes(covered_arm(test::arm_limits(nv)));
    head.settings = recording::to_records(ControllerSettings{});
    head.fields = recording::fields_of_commands();
    head.whole = false;
    write(RecordKind::head, head);
  }

  template <class Record>
  void write(RecordKind kind, const Record& record) {
    recording::Bytes content;
    recording::Encoder<recording::Bytes> out(content);
    describe(out, record);
    box.write(kind, time, content.bytes);
  }
  /// A world of one source with as many points.
  void write_world(std::uint64_t number, Eigen::Index num_points = 1) {
    const Eigen::Matrix3Xd points = Eigen::Matrix3Xd::Random(3, num_points).array() + 2.0;
    box.write_set(time, {number, 1,
                         std::make_shared<const Obstacles>(points, Eigen::VectorXd::Constant(num_points, 0.01),
                                                           Eigen::Matrix3Xd::Zero(3, num_points))});
    constexpr double for_ever = std::numeric_limits<double>::infinity();
    write(RecordKind::world,
          recording::WorldRecord{number, {{"camera", 1, number, number, time, time, for_ever, for_ever, false, false}}});
  }
  void write_step(std::uint64_t world, const Command& command = Command(nv)) {
    time += box_period;
    recording::Bytes content;
    recording::Encoder<recording::Bytes> out(content);
    const Eigen::VectorXd zero = Eigen::VectorXd::Zero(nv);
    const std::uint64_t none = 0;
    out(++steps, time, zero, zero, false, none, none, world, none, none, recording::TakenKind::end);
    const auto place = static_cast<recording::CommandPlace>(content.bytes.size());
    recording::write_command(out, command);
    out(place);
    box.write(RecordKind::step, time, content.bytes);
  }

  BlackBox box;
  double time = 0.0;
  std::uint64_t steps = 0;
};

}  // namespace

BOOST_AUTO_TEST_CASE(worlds_that_wait_for_their_steps_are_in_the_files_that_begin_between) {
  const BoxFolder folder;
  WrittenBox written(folder.path, 0.3);  // files of ten steps
  constexpr std::uint64_t count = 200;   // sets while the disk was slow, each with a step that took it
  for (std::uint64_t n = 1; n <= count; ++n) {
    written.write_world(n);
  }
  written.write_step(1);
  written.box.flush();  // in time for some
  for (std::uint64_t n = 2; n <= count; ++n) {
    written.write_step(n);
  }
  written.box.close();
  const RecordedRun run = read_recorded_run(written.box.files());
  BOOST_TEST(run.damage == "");
  BOOST_TEST(run.steps >= 30U);
  BOOST_TEST(run.time.back() == count * box_period, boost::test_tools::tolerance(1e-9));
}

BOOST_AUTO_TEST_CASE(what_nobody_steps_with_is_forgotten) {
  const BoxFolder folder;
  WrittenBox written(folder.path);
  written.write_world(1);
  for (std::uint64_t n = 1; n <= 10'000; ++n) {  // 2 MB of requests, and as many worlds
    recording::RequestRecord request;
    request.number = n;
    request.kind = recording::RequestRecord::Kind::joint_goal;
    request.position = Eigen::VectorXd::Zero(nv);
    written.write(RecordKind::request, request);
    written.write_world(n + 1);
    if (n % 20 == 0) {
      written.box.flush();
    }
  }
  written.write_step(10'001);
  written.box.close();
  BOOST_TEST(written.box.files().size() > 1U);
  for (const auto& file : written.box.files()) {
    BOOST_TEST(std::filesystem::file_size(file) < least_bytes / 3);  // a quarter, and what each begins with
  }
  const RecordedRun run = read_recorded_run({written.box.files().back()});
  BOOST_TEST(run.damage == "");
  BOOST_TEST(run.steps == 1U);
}

BOOST_AUTO_TEST_CASE(files_that_were_written_to_last_stay) {
  const BoxFolder folder;
  std::uint64_t world = 0;
  const auto write = [&world](WrittenBox& to, int sets) {  // ten sets fill a file, a quarter of all
    for (int k = 0; k < sets; ++k) {
      to.write_world(++world, 1000);
      to.write_step(world);
    }
    to.box.flush();
  };
  WrittenBox running(folder.path), ended(folder.path);
  write(running, 12);
  write(ended, 14);
  ended.box.close();
  const std::vector<std::filesystem::path> others = ended.box.files();
  BOOST_TEST(others.size() == 2U);
  for (const auto& file : others) {
    std::filesystem::last_write_time(file, std::filesystem::file_time_type::clock::now() - std::chrono::hours(1));
  }
  write(running, 12);
  const std::vector<std::filesystem::path> mine = running.box.files();
  BOOST_TEST(mine.size() == 3U);
  for (const auto& file : mine) {
    BOOST_TEST(std::filesystem::exists(file));
  }
  BOOST_TEST(!std::filesystem::exists(others.front()));
  WrittenBox younger(folder.path);
  write(younger, 24);
  BOOST_TEST(!std::filesystem::exists(others.back()));
  BOOST_TEST(!std::filesystem::exists(mine.front()));
  BOOST_TEST(std::filesystem::exists(mine.back()));  // which the other one has open
  running.box.close();
  const RecordedRun run = read_recorded_run({mine.back()});
  BOOST_TEST(run.damage == "");
  BOOST_TEST(run.time.back() == 24 * box_period, boost::test_tools::tolerance(1e-9));
}

BOOST_AUTO_TEST_CASE(a_file_that_cannot_be_ended_is_told) {
  const BoxFolder folder;
  WrittenBox written(folder.path, 3.0);  // files of 1 s
  rlimit before{};
  BOOST_TEST_REQUIRE(getrlimit(RLIMIT_FSIZE, &before) == 0);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit small = before;
  small.rlim_cur = 1000;
  BOOST_TEST_REQUIRE(setrlimit(RLIMIT_FSIZE, &small) == 0);
  int told = 0;
  try {
    for (int k = 0; k < 150; ++k) {
      written.write_step(0);  // all in the buffer of the file
    }
  } catch (const std::system_error& error) {
    told = error.code().value();
  }
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  BOOST_TEST(told == EFBIG);
}

BOOST_AUTO_TEST_CASE(steps_of_an_arm_that_the_box_does_not_hold_are_read) {
  const BoxFolder folder;
  WrittenBox written(folder.path);
  Command command(nv);
  command.coordinate = command.bound_by = 1'000'000;  // held something then
  command.clearance = 0.1;
  written.write_step(0, command);
  command.coordinate = command.bound_by = 0;
  written.write_step(0, command);
  written.box.close();
  const RecordedRun run = read_recorded_run(written.box.files());
  BOOST_TEST(run.damage == "");
  BOOST_TEST_REQUIRE(run.steps == 2U);
  BOOST_TEST(run.nearest[0] == -1);
  BOOST_TEST(run.bound_by[0] == -1);
  BOOST_TEST(run.nearest[1] == 0);
  BOOST_TEST(run.explain(0).find("nearest") == std::string::npos);
}

BOOST_AUTO_TEST_CASE(a_command_with_another_number_of_joints_is_damage) {
  for (int field = 0; field < 2; ++field) {
    const BoxFolder folder;
    WrittenBox written(folder.path);
    written.write_step(0);
    Command command(nv);
    if (field == 0) {
      command.torque.resize(nv - 1);
      command.torque.setZero();
    } else {
      command.limits.resize(nv + 1);
    }
    written.write_step(0, command);
    written.box.close();
    const RecordedRun run = read_recorded_run(written.box.files());
    BOOST_TEST(run.steps == 1U);
    BOOST_TEST(run.torque.size() == static_cast<std::size_t>(nv));
    BOOST_TEST(run.limits.size() == static_cast<std::size_t>(nv));
    const std::string what =
        field == 0 ? "a step's torque has " + std::to_string(nv - 1) : "a step's limits has " + std::to_string(nv + 1);
    BOOST_TEST(run.damage.find(what + " entries, the arm " + std::to_string(nv) + " coordinates") != std::string::npos);
  }
}

BOOST_AUTO_TEST_CASE(files_after_a_damaged_one_are_read) {
  const BoxFolder folder;
  WrittenBox written(folder.path, 3.0);  // files of 1 s: 100 steps
  written.write_world(1);
  for (int k = 0; k < 350; ++k) {
    written.write_step(k < 320 ? 1 : 2);
    if (k == 150) {
      written.write_world(2);
    }
  }
  written.box.close();
  const std::vector<std::filesystem::path> files = written.box.files();
  BOOST_TEST_REQUIRE(files.size() == 4U);
  std::fstream second(files[1], std::ios::in | std::ios::out | std::ios::binary);
  second.seekp(static_cast<std::streamoff>(3 * std::filesystem::file_size(files[1]) / 4));
  second.put('\x55').put('\x55');
  second.close();
  std::filesystem::resize_file(files[2], 4);  // its program was killed as it began
  const RecordedRun run = read_recorded_run(files);
  BOOST_TEST(run.damage.find(files[1].string()) != std::string::npos);
  BOOST_TEST(run.damage.find("are not those that were written") != std::string::npos);
  BOOST_TEST(run.steps > 200U);
  BOOST_TEST(run.steps < 250U);
  BOOST_TEST(run.time.back() == 350 * box_period, boost::test_tools::tolerance(1e-9));
  BOOST_CHECK_THROW(read_recorded_run({files[2]}), std::invalid_argument);
}
