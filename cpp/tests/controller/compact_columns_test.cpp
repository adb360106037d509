// Columns come back bit for bit, whatever they have in common with others.
#include "../../src/controller/compact_columns.hpp"

#include <boost/test/unit_test.hpp>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>

#include "support/random.hpp"

using namespace sidestep;
using recording::Bytes;
using recording::CompactColumns;
using recording::Decoder;

namespace {

Eigen::MatrixXd there_and_back(const Eigen::MatrixXd& columns, const Eigen::MatrixXd& base, std::size_t* size = nullptr) {
  Bytes bytes;
  CompactColumns::write(columns, base, bytes);
  if (size != nullptr) {
    *size = bytes.bytes.size();
  }
  Decoder in(bytes.bytes);
  Eigen::MatrixXd read = CompactColumns::read(in, columns.rows(), base);
  BOOST_TEST(in.rest().empty());
  return read;
}

bool same(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() &&
         std::memcmp(a.data(), b.data(), static_cast<std::size_t>(a.size()) * sizeof(double)) == 0;
}

Eigen::MatrixXd random_columns(test::Random& random, Eigen::Index rows, Eigen::Index columns) {
  Eigen::MatrixXd all(rows, columns);
  for (Eigen::Index j = 0; j < columns; ++j) {
    all.col(j) = random.vector(static_cast<int>(rows));
  }
  return all;
}

}  // namespace

BOOST_AUTO_TEST_CASE(numbers_come_back_bit_for_bit) {
  test::Random random(3);
  const Eigen::MatrixXd none(8, 0), base = random_columns(random, 8, 200);
  BOOST_TEST(same(there_and_back(none, none), none));
  BOOST_TEST(same(there_and_back(base, none), base));
  for (int trial = 0; trial < 200; ++trial) {
    Eigen::MatrixXd columns(8, 0);
    for (Eigen::Index k = 0; k < 200; ++k) {  // some go, some come, some change
      const double chance = random.uniform(0.0, 1.0);
      if (chance < 0.1) {
        continue;
      }
      columns.conservativeResize(8, columns.cols() + 1);
      columns.rightCols(1) = base.col(k);
      if (chance < 0.2) {
        columns(3, columns.cols() - 1) += 0.01;
      }
    }
    if (trial % 3 == 0) {
      columns.row(4).setZero();
    }
    BOOST_REQUIRE(same(there_and_back(columns, base), columns));
  }
  Eigen::MatrixXd odd = base.leftCols(5);
  odd(0, 0) = std::numeric_limits<double>::quiet_NaN();
  odd(1, 1) = -0.0;
  odd(2, 2) = std::numeric_limits<double>::infinity();
  BOOST_TEST(same(there_and_back(odd, base), odd));
  for (const double value :
       {1e-40, 1e-300, 1e39, -0.0, 0.1, 0.5, 3.4028234663852886e38, 1.1754943508222875e-38}) {  // as floats or not
    odd = Eigen::MatrixXd::Constant(8, 2, 1.0);
    odd.col(0).setConstant(value);
    BOOST_TEST(same(there_and_back(odd, none), odd));
  }
}

BOOST_AUTO_TEST_CASE(what_is_the_same_takes_few_bytes) {
  test::Random random(4);
  Eigen::MatrixXd base = random_columns(random, 8, 1000);
  base.bottomRows(4).setConstant(0.0);
  std::size_t size = 0;
  BOOST_TEST(same(there_and_back(base, base, &size), base));
  BOOST_TEST(size < 64u);
  there_and_back(base, Eigen::MatrixXd(8, 0), &size);
  BOOST_TEST(size < 1000u * 4 * 8 + 64);
  Eigen::MatrixXd elsewhere(8, 1000);  // another order, and some new ones
  elsewhere << base.rightCols(400), base.middleCols(200, 400), base.leftCols(200);
  BOOST_TEST(same(there_and_back(elsewhere, base, &size), elsewhere));
  BOOST_TEST(size < 100u);
  elsewhere(0, 500) += 0.1;
  BOOST_TEST(same(there_and_back(elsewhere, base, &size), elsewhere));
  BOOST_TEST(size < 160u);
  const Eigen::MatrixXd narrow = base.cast<float>().cast<double>();
  there_and_back(narrow, Eigen::MatrixXd(8, 0), &size);
  BOOST_TEST(size < 1000u * 4 * 4 + 64);
}

BOOST_AUTO_TEST_CASE(bytes_that_are_none_are_refused) {
  test::Random random(5);
  const Eigen::MatrixXd base = random_columns(random, 8, 50), columns = base.middleCols(10, 30);
  Bytes bytes;
  CompactColumns::write(columns, base, bytes);
  for (std::size_t cut = 0; cut < bytes.bytes.size(); ++cut) {
    Decoder in(std::span(bytes.bytes).first(cut));
    BOOST_CHECK_THROW(CompactColumns::read(in, 8, base), std::invalid_argument);
  }
  Decoder in(bytes.bytes);
  BOOST_CHECK_THROW(CompactColumns::read(in, 8, base.leftCols(20)), std::invalid_argument);
  for (int trial = 0; trial < 2000; ++trial) {  // whatever comes back, nothing outside is read
    Bytes wrong = bytes;
    wrong.bytes[static_cast<std::size_t>(random.uniform(0.0, static_cast<double>(wrong.bytes.size()) - 1e-9))] =
        static_cast<std::byte>(static_cast<int>(random.uniform(0.0, 255.0)));
    Decoder mutated(wrong.bytes);
    try {
      BOOST_REQUIRE(CompactColumns::read(mutated, 8, base).rows() == 8);
    } catch (const std::invalid_argument&) {
    }
  }
}
