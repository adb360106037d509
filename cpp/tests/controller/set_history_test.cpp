// Sets of obstacles come back bit for bit, in few bytes where they differ little, and with the tree that they had.
#include "../../src/controller/set_history.hpp"

#include <boost/test/unit_test.hpp>
#include <stdexcept>
#include <vector>

#include "support/random.hpp"

using namespace sidestep;

namespace {

constexpr Eigen::Index num = 2000;
constexpr std::size_t head = 200;  // of a record without columns, at most [B]

struct Cloud {
  Eigen::Matrix3Xd points = Eigen::Matrix3Xd(3, num), velocities = Eigen::Matrix3Xd::Zero(3, num);
  Eigen::VectorXd radii = Eigen::VectorXd(num);

  explicit Cloud(test::Random& random) {
    Eigen::Matrix3Xf singles(3, num);
    for (Eigen::Index n = 0; n < num; ++n) {
      singles.col(n) = random.vector(3).cast<float>();
      radii[n] = static_cast<double>(static_cast<float>(random.uniform(0.01, 0.02)));
    }
    points = singles.cast<double>();
  }
  Obstacles made() const { return Obstacles(points, radii, velocities); }
};

/// Writes and reads, as one file after the other.
struct File {
  SetHistory writer, reader;
  std::uint64_t number = 0;
  std::size_t size = 0;
  std::vector<std::byte> bytes;

  RecordedSet there_and_back(std::uint64_t source, const Obstacles& obstacles) {
    recording::Bytes out;
    writer.write({++number, source, std::make_shared<const Obstacles>(obstacles)}, out);
    bytes = out.bytes;
    size = bytes.size();
    RecordedSet read = reader.read(bytes);
    BOOST_TEST(read.number == number);
    BOOST_TEST(read.source == source);
    return read;
  }
};

bool same(const Obstacles& a, const Obstacles& b) {
  return a.points() == b.points() && a.radii() == b.radii() && a.velocities() == b.velocities() &&
         a.uncertainty() == b.uncertainty() && a.groups() == b.groups() && a.tree().order() == b.tree().order();
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_set_that_differs_little_from_the_one_before_takes_few_bytes) {
  test::Random random(1);
  Cloud cloud(random), other(random);
  File file;
  BOOST_TEST(same(*file.there_and_back(1, cloud.made()).points, cloud.made()));
  BOOST_TEST(file.size < 16 * num + head);
  BOOST_TEST(same(*file.there_and_back(2, other.made()).points, other.made()));
  BOOST_TEST(file.size > 16 * num);
  BOOST_TEST(same(*file.there_and_back(1, cloud.made()).points, cloud.made()));
  BOOST_TEST(file.size < head);
  cloud.points.middleCols(100, 50).setConstant(0.5);
  cloud.velocities.middleCols(100, 50).setConstant(0.25);
  BOOST_TEST(same(*file.there_and_back(1, cloud.made()).points, cloud.made()));
  BOOST_TEST(file.size < 50 * 32 + head);
  const Obstacles uncertain = cloud.made().moving(cloud.velocities, Eigen::VectorXd::Constant(num, 0.1));
  BOOST_TEST(same(*file.there_and_back(1, uncertain).points, uncertain));
  BOOST_TEST(same(*file.there_and_back(2, Obstacles::none()).points, Obstacles::none()));
  const Obstacles named = other.made().named({"table", ""}, {num - 10, 10});
  BOOST_TEST(same(*file.there_and_back(2, named).points, named));
}

BOOST_AUTO_TEST_CASE(an_order_that_points_do_not_tell_is_written) {
  test::Random random(2);
  Cloud cloud(random);
  for (Eigen::Index n = 0; n < num; n += 3) {
    cloud.velocities.col(n) = random.vector(3);
  }
  Obstacles moved = cloud.made();
  File file;
  BOOST_TEST(same(*file.there_and_back(1, moved).points, moved));
  moved.advance(2.0);
  BOOST_TEST((moved.tree().order() != Obstacles(moved.points(), moved.radii(), moved.velocities()).tree().order()));
  BOOST_TEST(same(*file.there_and_back(1, moved).points, moved));
}

BOOST_AUTO_TEST_CASE(a_set_whose_base_is_missing_is_refused) {
  test::Random random(3);
  const Cloud cloud(random);
  File file;
  file.there_and_back(1, cloud.made());
  const std::vector<std::byte> first = file.bytes;
  file.there_and_back(1, cloud.made());
  SetHistory late;
  BOOST_CHECK_THROW(late.read(file.bytes), std::invalid_argument);
  BOOST_TEST(same(*late.read(first).points, cloud.made()));
  BOOST_TEST(same(*late.read(file.bytes).points, cloud.made()));
  BOOST_CHECK_THROW(late.read(file.bytes), std::invalid_argument);  // its base is the set before
}

BOOST_AUTO_TEST_CASE(sources_that_were_removed_are_forgotten) {
  test::Random random(4);
  const Cloud cloud(random);
  File file;
  for (std::uint64_t source = 1; source <= 40; ++source) {  // 32 at most are there at once
    file.there_and_back(source, cloud.made());
  }
  BOOST_TEST(same(*file.there_and_back(40, cloud.made()).points, cloud.made()));
  BOOST_TEST(file.size < head);
  BOOST_TEST(same(*file.there_and_back(1, cloud.made()).points, cloud.made()));
  BOOST_TEST(file.size > 16 * num);
}
