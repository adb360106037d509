// Arms: what they refuse, and their files: round trips, and damage of every kind.
#include "sidestep/arm/arm.hpp"

#include <boost/test/unit_test.hpp>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <iterator>
#include <limits>
#include <numbers>
#include <random>
#include <span>
#include <system_error>

#include "../../src/arm/arm_file.hpp"
#include "../../src/arm/sha256.hpp"
#include "support/random_scene.hpp"

using namespace sidestep;
using test::Random;

namespace {

constexpr std::size_t header_size = 52, version_place = 8, size_place = 12, hash_place = 20;
using Bytes = std::vector<std::byte>;

PairDistanceTable small_table() {
  PairDistanceTable table;
  table.first = "link0";
  table.second = "link2";
  table.axes[0] = {1, -1.0, 0.5, false};
  table.axes[1] = {2, -std::numbers::pi, 2.0 * std::numbers::pi / 4.0, true};
  table.control = Eigen::MatrixXd::Constant(5, 4, 0.1);
  table.control(3, 2) = -0.02;
  return table;
}

/// The parts of a small arm, to be changed before it is made.
struct Parts {
  Robot robot;
  Body body;
  std::vector<LinkPair> pairs;
  std::vector<PairDistanceTable> tables;
  std::vector<Inertial> inertials;
  ArmDetails details;

  Arm arm() const { return Arm(robot, body, pairs, tables, inertials, details); }
};

Parts small_parts(unsigned seed = 1) {
  Random random(seed);
  Robot robot = test::random_tree(random, 4);
  const Body density = test::random_body(random, robot);
  Body body(density.links, density.weights, density.means, density.covariances,
            Eigen::VectorXd::Constant(density.num_components(), 5.0));
  std::vector<Inertial> inertials(robot.joints().size());
  for (Inertial& inertial : inertials) {
    inertial = {random.uniform(0.1, 3.0), 0.1 * random.vector(3), 0.01 * random.positive_definite(3, 0.1)};
  }
  const ArmDetails details{{{"link1", 1.0, 0.003, 0.012, 1.2, "mesh", 0.97, 0.3}},
                           {{"link1", "link3"}},
                           {"tree.urdf", "f00d", "0.2.0", "2026-11-25"}};
  return {std::move(robot), std::move(body), {{"link0", "link3", -0.01}}, {small_table()}, std::move(inertials), details};
}

class Folder {
 public:
  Folder() : path_(std::filesystem::temp_directory_path() / ("sidestep-arm-test-" + std::to_string(std::random_device{}()))) {
    std::filesystem::create_directory(path_);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  ~Folder() { std::filesystem::remove_all(path_); }
  std::filesystem::path operator/(const char* name) const { return path_ / name; }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

Bytes bytes_of(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(stream), {}};
  const auto bytes = std::as_bytes(std::span<const char>(text));
  return {bytes.begin(), bytes.end()};
}

Bytes file_of(const Arm& arm) {
  const ArmDetails details{arm.proof(), arm.allowed_pairs(), arm.provenance()};
  return encode_arm({arm.robot(), arm.body(), arm.pairs(), arm.tables(), arm.inertials(), details});
}

/// Makes size and hash those of the payload, as one does who wants the damage to get past them.
void seal(Bytes& file) {
  const std::span<const std::byte> payload = std::span<const std::byte>(file).subspan(header_size);
  for (std::size_t k = 0; k < 8; ++k) {
    file[size_place + k] = static_cast<std::byte>(payload.size() >> (8 * k));
  }
  const Sha256 hash = sha256(payload);
  std::copy(hash.begin(), hash.end(), file.begin() + hash_place);
}

std::string complaint(const Bytes& file) {
  try {
    decode_arm(file);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "none";
}

std::string complaint(const Parts& parts) {
  try {
    parts.arm();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "none";
}

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

}  // namespace

BOOST_AUTO_TEST_CASE(sha256_of_the_standards_examples) {
  const auto hash = [](const std::string& text) { return hexadecimal(sha256(std::as_bytes(std::span<const char>(text)))); };
  BOOST_TEST(hash("") == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  BOOST_TEST(hash("abc") == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  BOOST_TEST(hash("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq") ==
             "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  BOOST_TEST(hash(std::string(1000000, 'a')) == "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

BOOST_AUTO_TEST_CASE(file_round_trip_is_exact) {
  const Folder folder;
  const Arm arm = small_parts().arm();
  arm.save(folder / "a.arm");
  const Arm read = Arm::load(folder / "a.arm");
  BOOST_TEST(read.name() == "tree");
  BOOST_TEST(read.robot().same_joints(arm.robot()));
  BOOST_TEST((read.robot().limits().lower == arm.robot().limits().lower));
  BOOST_TEST((read.robot().limits().velocity == arm.robot().limits().velocity));  // infinite here
  BOOST_TEST((read.robot().frames()[3].X_JF.matrix() == arm.robot().frames()[3].X_JF.matrix()));
  BOOST_TEST(read.robot().frames()[3].name == "link3");
  BOOST_TEST((read.body().links == arm.body().links));
  BOOST_TEST((read.body().weights == arm.body().weights));
  BOOST_TEST((read.body().means == arm.body().means));
  BOOST_TEST((read.body().covariances == arm.body().covariances));
  BOOST_TEST((read.body().levels == arm.body().levels));
  BOOST_TEST(read.pairs().at(0).second == "link3");
  BOOST_TEST(read.pairs().at(0).contact == -0.01);
  BOOST_TEST((read.tables().at(0).control == arm.tables()[0].control));
  BOOST_TEST(read.tables()[0].axes[0].spacing == 0.5);
  BOOST_TEST(read.tables()[0].axes[1].periodic);
  BOOST_TEST(read.inertials().at(2).mass == arm.inertials()[2].mass);
  BOOST_TEST((read.inertials()[2].com == arm.inertials()[2].com));
  BOOST_TEST((read.inertials()[2].inertia == arm.inertials()[2].inertia));
  BOOST_TEST(read.proof().at(0).max_overshoot == 0.012);
  BOOST_TEST(read.proof()[0].volume_of == "mesh");
  BOOST_TEST(read.allowed_pairs().at(0).second == "link3");
  BOOST_TEST(read.provenance().date == "2026-11-25");
  BOOST_TEST(read.content_hash() == arm.content_hash());
  read.save(folder / "b.arm");
  BOOST_TEST((bytes_of(folder / "a.arm") == bytes_of(folder / "b.arm")));
  // Nothing is left beside the files.
  const std::filesystem::directory_iterator entries(folder.path());
  BOOST_TEST(std::distance(begin(entries), end(entries)) == 2);
}

BOOST_AUTO_TEST_CASE(content_hash_leaves_out_the_provenance_alone) {
  Parts parts = small_parts();
  const std::string hash = parts.arm().content_hash();
  parts.details.provenance.date = "2027-01-01";
  BOOST_TEST(parts.arm().content_hash() == hash);
  parts.pairs[0].contact = -0.011;
  BOOST_TEST(parts.arm().content_hash() != hash);
  BOOST_TEST(small_parts().arm().content_hash() == hash);
}

BOOST_AUTO_TEST_CASE(every_flipped_byte_is_found) {
  const Bytes good = file_of(small_parts().arm());
  BOOST_TEST(complaint(good) == "none");
  for (std::size_t i = 0; i < good.size(); ++i) {
    for (const int bit : {0, 7}) {
      Bytes file = good;
      file[i] ^= static_cast<std::byte>(1 << bit);
      if (complaint(file) == "none") {
        BOOST_ERROR("byte " + std::to_string(i) + " is not checked");
      }
    }
  }
}

BOOST_AUTO_TEST_CASE(every_truncation_is_found) {
  const Bytes good = file_of(small_parts().arm());
  for (std::size_t size = 0; size < good.size(); ++size) {
    Bytes file(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size));
    if (complaint(file) == "none") {
      BOOST_ERROR("a file of " + std::to_string(size) + " bytes is read");
    }
    if (size >= header_size) {
      seal(file);
      if (complaint(file) == "none") {
        BOOST_ERROR("a sealed file of " + std::to_string(size) + " bytes is read");
      }
    }
  }
  Bytes longer = good;
  longer.push_back({});
  BOOST_TEST(contains(complaint(longer), "cut off or changed"));
  seal(longer);
  BOOST_TEST(contains(complaint(longer), "the payload has 1 bytes too many"));
}

BOOST_AUTO_TEST_CASE(sealed_damage_is_refused_or_makes_a_valid_arm) {
  // Behind a right hash anything may stand: sizes of gigabytes, numbers that are not finite. Whatever is read is an
  // arm.
  const Bytes good = file_of(small_parts().arm());
  Random random(7);
  int refused = 0;
  for (std::size_t i = header_size; i < good.size(); ++i) {
    for (const int value : {0x00, 0x7f, 0xff, random.integer(0, 255)}) {
      Bytes file = good;
      file[i] = static_cast<std::byte>(value);
      seal(file);
      try {
        const Arm arm = decode_arm(file);
        BOOST_TEST_REQUIRE((file_of(arm) == file));
      } catch (const std::invalid_argument&) {
        ++refused;
      }
    }
  }
  BOOST_TEST(refused > 1000);
  for (int trial = 0; trial < 2000; ++trial) {
    Bytes file = good;
    for (int k = 0; k < 8; ++k) {
      file[static_cast<std::size_t>(random.integer(static_cast<int>(header_size), static_cast<int>(file.size()) - 1))] =
          static_cast<std::byte>(random.integer(0, 255));
    }
    seal(file);
    try {
      const Arm arm = decode_arm(file);
      BOOST_TEST_REQUIRE((file_of(arm) == file));
    } catch (const std::invalid_argument&) {
    }
  }
}

BOOST_AUTO_TEST_CASE(complaints_say_what_is_wrong) {
  const Bytes good = file_of(small_parts().arm());
  Bytes file = good;
  file[0] = std::byte{'P'};
  BOOST_TEST(contains(complaint(file), "it is not an arm file; prepare the arm again"));
  BOOST_TEST(contains(complaint(Bytes{}), "it is not an arm file"));
  file = good;
  file[version_place] = std::byte{9};
  BOOST_TEST(contains(complaint(file), "format version 9, this Sidestep reads versions 1 to 2; install a newer Sidestep"));
  file = good;
  file[hash_place + 3] ^= std::byte{1};
  BOOST_TEST(contains(complaint(file), "does not have the hash that it states: it is damaged; prepare the arm again"));
  file.resize(good.size() - 5);
  BOOST_TEST(contains(complaint(file), "it was cut off or changed"));

  const Folder folder;
  std::ofstream(folder / "text.arm") << "<robot/>";
  BOOST_CHECK_EXCEPTION(Arm::load(folder / "text.arm"), std::invalid_argument, [](const auto& error) {
    return contains(error.what(), "text.arm") && contains(error.what(), "not an arm file");
  });
  BOOST_CHECK_EXCEPTION(Arm::load(folder / "missing.arm"), std::system_error, [](const auto& error) {
    return contains(error.what(), "missing.arm") && error.code() == std::errc::no_such_file_or_directory;
  });
  BOOST_CHECK_THROW(Arm::load(folder.path()), std::system_error);
  BOOST_CHECK_EXCEPTION(small_parts().arm().save(folder / "nowhere/a.arm"), std::system_error, [](const auto& error) {
    return contains(error.what(), "nowhere") && error.code() == std::errc::no_such_file_or_directory;
  });
}

BOOST_AUTO_TEST_CASE(a_failed_save_leaves_what_was_there) {
  const Folder folder;
  std::filesystem::create_directory(folder / "taken.arm");
  std::ofstream(folder / "taken.arm/inside") << "kept";
  BOOST_CHECK_THROW(small_parts().arm().save(folder / "taken.arm"), std::system_error);
  BOOST_TEST(std::filesystem::exists(folder / "taken.arm/inside"));
  const std::filesystem::directory_iterator entries(folder.path());
  BOOST_TEST(std::distance(begin(entries), end(entries)) == 1);
}

BOOST_AUTO_TEST_CASE(inconsistent_parts_are_refused) {
  const auto refuses = [](auto change, const std::string& what) {
    Parts parts = small_parts();
    change(parts);
    const std::string found = complaint(parts);
    BOOST_TEST(contains(found, what), found);
  };
  refuses([](Parts& p) { p.body.levels.resize(0); }, "not calibrated");
  refuses([](Parts& p) { p.body.links[0] = "nothing"; }, "no link 'nothing'");
  refuses([](Parts& p) { p.pairs[0].first = "nothing"; }, "no link 'nothing'");
  refuses([](Parts& p) { p.pairs[0].first = "link3"; }, "pair of link 'link3' with itself");
  refuses([](Parts& p) { p.pairs[0].contact = std::nan(""); }, "contact is nan, must be finite");
  refuses([](Parts& p) { p.tables[0].second = "nothing"; }, "no link 'nothing'");
  refuses([](Parts& p) { p.tables[0].axes[0].coordinate = 3; }, "coordinate is 3, must be from 0 to 2");
  refuses([](Parts& p) { p.tables[0].control(0, 0) = std::numeric_limits<double>::infinity(); }, "must be finite");
  refuses([](Parts& p) { p.inertials.pop_back(); }, "4 joints and 3 inertias");
  refuses([](Parts& p) { p.inertials[0].mass = -1.0; }, "mass is -1");
  refuses([](Parts& p) { p.details.allowed_pairs[0].first = "nothing"; }, "no link 'nothing'");
  refuses([](Parts& p) { p.details.proof[0].link = "nothing"; }, "no link 'nothing'");
  refuses([](Parts& p) { p.details.proof[0].coverage = std::nan(""); }, "cover of link 'link1'");
}

BOOST_AUTO_TEST_CASE(arm_without_inertias_has_no_dynamics) {
  Parts parts = small_parts();
  BOOST_TEST(parts.arm().has_dynamics());
  BOOST_TEST(parts.arm().dynamics().inertials().size() == 4U);
  parts.inertials.clear();
  const Arm arm = decode_arm(file_of(parts.arm()));
  BOOST_TEST(!arm.has_dynamics());
  BOOST_CHECK_THROW(arm.dynamics(), std::invalid_argument);
}

BOOST_AUTO_TEST_CASE(neutral_is_in_the_middle_of_the_limits) {
  Parts parts = small_parts();
  JointLimits limits = parts.robot.limits();
  const double infinity = std::numeric_limits<double>::infinity();
  limits.lower << -1.0, 0.5, -infinity;
  limits.upper << 2.0, infinity, infinity;
  parts.robot = Robot("tree", parts.robot.joints(), parts.robot.frames(), parts.robot.coordinate_names(), limits);
  BOOST_TEST((parts.arm().neutral() == Eigen::Vector3d(0.5, 0.5 + std::numbers::pi, 0.0)));
}

BOOST_AUTO_TEST_CASE(copies_share_their_content) {
  const Arm arm = small_parts().arm();
  const Arm copy = arm;
  BOOST_TEST(&copy.robot() == &arm.robot());
}
