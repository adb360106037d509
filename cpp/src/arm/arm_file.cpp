#include "arm_file.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#if defined(__unix__) || defined(__APPLE__)
#include <unistd.h>
#endif

#include "sha256.hpp"

// The file, little endian: magic (8 bytes), version (u32), size of the payload (u64), SHA-256 of the payload (32
// bytes), payload. The payload is a row of sections in a fixed order: tag (4 bytes), size (u64), content. A text is its
// size (u32) and UTF-8; a list is its length (u32) and its entries; numbers are IEEE doubles, matrices by columns.
namespace sidestep {
namespace {

constexpr std::string_view magic{"\x89SSARM\r\n", 8};  // not text; a transfer that changes line ends breaks it
constexpr std::uint32_t version = 2;
constexpr std::uint32_t oldest_version = 1;  // without jerk limits and rates of effort: they are the defaults
constexpr std::size_t header_size = 8 + 4 + 8 + 32;
constexpr std::uintmax_t largest_file = std::uintmax_t{1} << 30;  // [B] an arm has less than a thousandth of it
constexpr const char* advice = "; prepare the arm again: sidestep prepare NAME -o FILE";

class Writer {
 public:
  template <class Integer>
  void integer(Integer value) {
    const auto bits = static_cast<std::make_unsigned_t<Integer>>(value);
    for (std::size_t k = 0; k < sizeof(bits); ++k) {
      bytes_.push_back(static_cast<std::byte>(bits >> (8 * k)));
    }
  }
  void number(double value) { integer(std::bit_cast<std::uint64_t>(value)); }
  template <class Matrix>
  void numbers(const Matrix& matrix) {
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) {
      for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
        number(matrix(i, j));
      }
    }
  }
  void count(std::size_t size) {
    if (size > std::numeric_limits<std::uint32_t>::max()) {
      throw std::length_error("an arm file holds lists of at most 4294967295 entries");
    }
    integer(static_cast<std::uint32_t>(size));
  }
  void raw(std::string_view text) {
    for (const char c : text) {
      bytes_.push_back(static_cast<std::byte>(c));
    }
  }
  void raw(std::span<const std::byte> bytes) { bytes_.insert(bytes_.end(), bytes.begin(), bytes.end()); }
  void text(std::string_view text) {
    count(text.size());
    raw(text);
  }
  void pose(const Eigen::Isometry3d& X) { numbers(X.matrix().topRows<3>().eval()); }
  /// A section whose content `write` writes.
  template <class Write>
  void section(std::string_view tag, Write&& write) {
    Writer content;
    write(content);
    raw(tag);
    integer(static_cast<std::uint64_t>(content.bytes_.size()));
    raw(content.bytes_);
  }
  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  std::vector<std::byte> bytes_;
};

class Reader {
 public:
  explicit Reader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  std::span<const std::byte> raw(std::size_t size) {
    if (size > bytes_.size()) {
      throw std::invalid_argument(std::string("it ends where more must follow") + advice);
    }
    const auto taken = bytes_.first(size);
    bytes_ = bytes_.subspan(size);
    return taken;
  }
  template <class Integer>
  Integer integer() {
    std::make_unsigned_t<Integer> bits = 0;
    std::size_t k = 0;
    for (const std::byte byte : raw(sizeof(bits))) {
      bits = static_cast<decltype(bits)>(bits | (static_cast<decltype(bits)>(byte) << (8 * k++)));
    }
    return static_cast<Integer>(bits);
  }
  double number() { return std::bit_cast<double>(integer<std::uint64_t>()); }
  /// A matrix of as many numbers as there are, checked before anything is allocated.
  Eigen::MatrixXd numbers(std::size_t rows, std::size_t cols) {
    if (cols != 0 && rows > bytes_.size() / 8 / cols) {
      throw std::invalid_argument(std::string("a list is longer than the file") + advice);
    }
    Eigen::MatrixXd matrix(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(cols));
    for (double& value : matrix.reshaped()) {
      value = number();
    }
    return matrix;
  }
  /// The length of a list whose entries have at least so many bytes.
  std::size_t count(std::size_t smallest_entry) {
    const std::size_t size = integer<std::uint32_t>();
    if (size > bytes_.size() / smallest_entry) {
      throw std::invalid_argument(std::string("a list is longer than the file") + advice);
    }
    return size;
  }
  std::string text() {
    const auto bytes = raw(count(1));
    std::string text(bytes.size(), '\0');
    std::transform(bytes.begin(), bytes.end(), text.begin(), [](std::byte b) { return static_cast<char>(b); });
    return text;
  }
  Eigen::Isometry3d pose() {
    Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
    X.matrix().topRows<3>() = numbers(3, 4);
    return X;
  }
  bool flag() { return choice(2, "a flag") == 1; }
  /// One of the numbers below `end`.
  int choice(int end, const char* what) {
    const int value = integer<std::uint8_t>();
    if (value >= end) {
      throw std::invalid_argument(std::string(what) + " is " + std::to_string(value) + ", must be below " +
                                  std::to_string(end) + advice);
    }
    return value;
  }
  /// What `read` makes of the section that must follow.
  template <class Read>
  auto section(std::string_view tag, Read&& read) {
    const auto found = raw(tag.size());
    if (!std::equal(tag.begin(), tag.end(), found.begin(),
                    [](char c, std::byte b) { return static_cast<std::byte>(c) == b; })) {
      throw std::invalid_argument("section " + std::string(tag) + " is missing" + advice);
    }
    const auto size = integer<std::uint64_t>();
    if (size > bytes_.size()) {
      throw std::invalid_argument("section " + std::string(tag) + " is longer than the file" + advice);
    }
    Reader content(raw(static_cast<std::size_t>(size)));
    auto result = read(content);
    content.expect_end("section " + std::string(tag));
    return result;
  }
  void expect_end(const std::string& what) const {
    if (!bytes_.empty()) {
      throw std::invalid_argument(what + " has " + std::to_string(bytes_.size()) + " bytes too many" + advice);
    }
  }

 private:
  std::span<const std::byte> bytes_;
};

// Fewest bytes of an entry of each list: texts may be empty.
constexpr std::size_t smallest_text = 4, smallest_joint = 4 + 1 + 4 + 15 * 8 + 4 + 2 * 8, smallest_frame = 4 + 4 + 12 * 8;
constexpr std::size_t smallest_inertial = 13 * 8, smallest_component = 4 + (1 + 3 + 9 + 1) * 8;
constexpr std::size_t smallest_pair = 2 * 4, smallest_link_pair = 2 * 4 + 8, smallest_proof = 2 * 4 + 6 * 8;
constexpr std::size_t smallest_table = 2 * 4 + 2 * (4 + 2 * 8 + 1) + 2 * 4;

void write_robot(Writer& out, const Robot& robot) {
  out.text(robot.name());
  out.count(robot.joints().size());
  for (const Joint& joint : robot.joints()) {
    out.text(joint.name);
    out.integer(static_cast<std::uint8_t>(joint.type == JointType::prismatic ? 1 : 0));
    out.integer(static_cast<std::int32_t>(joint.parent));
    out.pose(joint.X_PJ);
    out.numbers(joint.axis);
    out.integer(static_cast<std::int32_t>(joint.coordinate));
    out.number(joint.multiplier);
    out.number(joint.offset);
  }
  out.count(robot.frames().size());
  for (const Frame& frame : robot.frames()) {
    out.text(frame.name);
    out.integer(static_cast<std::int32_t>(frame.joint));
    out.pose(frame.X_JF);
  }
  out.count(robot.coordinate_names().size());
  for (const std::string& name : robot.coordinate_names()) {
    out.text(name);
  }
  const JointLimits& limits = robot.limits();
  for (const auto* limit : {&limits.lower, &limits.upper, &limits.velocity, &limits.acceleration, &limits.effort, &limits.jerk,
                            &limits.effort_rate}) {
    out.numbers(*limit);
  }
}

Robot read_robot(Reader& in, std::uint32_t of_version) {
  std::string name = in.text();
  std::vector<Joint> joints(in.count(smallest_joint));
  for (Joint& joint : joints) {
    joint.name = in.text();
    joint.type = in.choice(2, "a joint's type") == 1 ? JointType::prismatic : JointType::revolute;
    joint.parent = in.integer<std::int32_t>();
    joint.X_PJ = in.pose();
    joint.axis = in.numbers(3, 1);
    joint.coordinate = in.integer<std::int32_t>();
    joint.multiplier = in.number();
    joint.offset = in.number();
  }
  std::vector<Frame> frames(in.count(smallest_frame));
  for (Frame& frame : frames) {
    frame.name = in.text();
    frame.joint = in.integer<std::int32_t>();
    frame.X_JF = in.pose();
  }
  std::vector<std::string> names(in.count(smallest_text));
  for (std::string& coordinate : names) {
    coordinate = in.text();
  }
  JointLimits limits;
  for (auto* limit : {&limits.lower, &limits.upper, &limits.velocity, &limits.acceleration, &limits.effort}) {
    *limit = in.numbers(names.size(), 1);
  }
  if (of_version > 1) {
    limits.jerk = in.numbers(names.size(), 1);
    limits.effort_rate = in.numbers(names.size(), 1);
  }
  return Robot(std::move(name), std::move(joints), std::move(frames), std::move(names), std::move(limits));
}

void write_inertials(Writer& out, const std::vector<Inertial>& inertials) {
  out.count(inertials.size());
  for (const Inertial& inertial : inertials) {
    out.number(inertial.mass);
    out.numbers(inertial.com);
    out.numbers(inertial.inertia);
  }
}

std::vector<Inertial> read_inertials(Reader& in) {
  std::vector<Inertial> inertials(in.count(smallest_inertial));
  for (Inertial& inertial : inertials) {
    inertial.mass = in.number();
    inertial.com = in.numbers(3, 1);
    inertial.inertia = in.numbers(3, 3);
  }
  return inertials;
}

void write_body(Writer& out, const Body& body) {
  out.count(body.links.size());
  for (const std::string& link : body.links) {
    out.text(link);
  }
  out.numbers(body.weights);
  out.numbers(body.means);
  for (const Eigen::Matrix3d& covariance : body.covariances) {
    out.numbers(covariance);
  }
  out.numbers(body.levels);
}

Body read_body(Reader& in) {
  const std::size_t num = in.count(smallest_component);
  std::vector<std::string> links(num);
  for (std::string& link : links) {
    link = in.text();
  }
  Eigen::VectorXd weights = in.numbers(num, 1);
  Eigen::Matrix3Xd means = in.numbers(3, num);
  std::vector<Eigen::Matrix3d> covariances(num);
  for (Eigen::Matrix3d& covariance : covariances) {
    covariance = in.numbers(3, 3);
  }
  Eigen::VectorXd levels = in.numbers(num, 1);
  return Body(std::move(links), std::move(weights), std::move(means), std::move(covariances), std::move(levels));
}

void write_proof(Writer& out, const std::vector<CoverProof>& proof) {
  out.count(proof.size());
  for (const CoverProof& link : proof) {
    out.text(link.link);
    out.text(link.volume_of);
    for (const double value :
         {link.coverage, link.mean_overshoot, link.max_overshoot, link.volume_ratio, link.interior_coverage, link.slimness}) {
      out.number(value);
    }
  }
}

std::vector<CoverProof> read_proof(Reader& in) {
  std::vector<CoverProof> proof(in.count(smallest_proof));
  for (CoverProof& link : proof) {
    link.link = in.text();
    link.volume_of = in.text();
    for (double* value : {&link.coverage, &link.mean_overshoot, &link.max_overshoot, &link.volume_ratio,
                          &link.interior_coverage, &link.slimness}) {
      *value = in.number();
    }
  }
  return proof;
}

void write_pairs(Writer& out, const std::vector<LinkPair>& pairs) {
  out.count(pairs.size());
  for (const LinkPair& pair : pairs) {
    out.text(pair.first);
    out.text(pair.second);
    out.number(pair.contact);
  }
}

std::vector<LinkPair> read_pairs(Reader& in) {
  std::vector<LinkPair> pairs(in.count(smallest_link_pair));
  for (LinkPair& pair : pairs) {
    pair.first = in.text();
    pair.second = in.text();
    pair.contact = in.number();
  }
  return pairs;
}

void write_tables(Writer& out, const std::vector<ClearanceTable>& tables) {
  out.count(tables.size());
  for (const ClearanceTable& table : tables) {
    out.text(table.first);
    out.text(table.second);
    for (const ClearanceTable::Axis& axis : table.axes) {
      out.integer(static_cast<std::int32_t>(axis.coordinate));
      out.number(axis.begin);
      out.number(axis.spacing);
      out.integer(static_cast<std::uint8_t>(axis.periodic ? 1 : 0));
    }
    out.count(static_cast<std::size_t>(table.control.rows()));
    out.count(static_cast<std::size_t>(table.control.cols()));
    out.numbers(table.control);
  }
}

std::vector<ClearanceTable> read_tables(Reader& in) {
  std::vector<ClearanceTable> tables(in.count(smallest_table));
  for (ClearanceTable& table : tables) {
    table.first = in.text();
    table.second = in.text();
    for (ClearanceTable::Axis& axis : table.axes) {
      axis.coordinate = in.integer<std::int32_t>();
      axis.begin = in.number();
      axis.spacing = in.number();
      axis.periodic = in.flag();
    }
    const std::size_t rows = in.integer<std::uint32_t>(), cols = in.integer<std::uint32_t>();
    table.control = in.numbers(rows, cols);
  }
  return tables;
}

using AllowedPairs = std::vector<std::pair<std::string, std::string>>;

void write_allowed(Writer& out, const AllowedPairs& pairs) {
  out.count(pairs.size());
  for (const auto& [first, second] : pairs) {
    out.text(first);
    out.text(second);
  }
}

AllowedPairs read_allowed(Reader& in) {
  AllowedPairs pairs(in.count(smallest_pair));
  for (auto& [first, second] : pairs) {
    first = in.text();
    second = in.text();
  }
  return pairs;
}

void write_content(Writer& out, const ArmParts& arm) {
  out.section("ROBT", [&](Writer& section) { write_robot(section, arm.robot); });
  out.section("INRT", [&](Writer& section) { write_inertials(section, arm.inertials); });
  out.section("BODY", [&](Writer& section) { write_body(section, arm.body); });
  out.section("PROF", [&](Writer& section) { write_proof(section, arm.details.proof); });
  out.section("PAIR", [&](Writer& section) { write_pairs(section, arm.pairs); });
  out.section("TABL", [&](Writer& section) { write_tables(section, arm.tables); });
  out.section("ALLW", [&](Writer& section) { write_allowed(section, arm.details.allowed_pairs); });
}

[[noreturn]] void throw_system_error(const std::string& what, const std::filesystem::path& path) {
  throw std::system_error(errno != 0 ? errno : EIO, std::generic_category(), what + " '" + path.string() + "'");
}

/// A file that is removed again unless it is moved to its place.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::filesystem::path& target) : path_(target) {
    path_ += ".part-" + std::to_string(std::random_device{}());
    errno = 0;
    file_ = std::fopen(path_.string().c_str(), "wbx");
    if (file_ == nullptr) {
      throw_system_error("cannot write arm file", target);
    }
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    if (file_ != nullptr) {
      std::fclose(file_);
    }
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }

  /// Writes everything through to the disk.
  bool write(std::span<const std::byte> bytes) {
    bool written = std::fwrite(bytes.data(), 1, bytes.size(), file_) == bytes.size() && std::fflush(file_) == 0;
#if defined(__unix__) || defined(__APPLE__)
    written = written && fsync(fileno(file_)) == 0;
#endif
    const bool closed = std::fclose(std::exchange(file_, nullptr)) == 0;
    return written && closed;
  }
  const std::filesystem::path& path() const noexcept { return path_; }

 private:
  std::filesystem::path path_;
  std::FILE* file_ = nullptr;
};

}  // namespace

std::vector<std::byte> encode_content(const ArmParts& parts) {
  Writer out;
  write_content(out, parts);
  return out.take();
}

std::vector<std::byte> encode_arm(const ArmParts& parts) {
  Writer payload;
  write_content(payload, parts);
  payload.section("PROV", [&](Writer& section) {
    const Provenance& from = parts.details.provenance;
    for (const std::string* text : {&from.source, &from.fingerprint, &from.sidestep_version, &from.date}) {
      section.text(*text);
    }
  });
  const std::vector<std::byte> bytes = payload.take();
  Writer file;
  file.raw(magic);
  file.integer(version);
  file.integer(static_cast<std::uint64_t>(bytes.size()));
  file.raw(sha256(bytes));
  file.raw(bytes);
  return file.take();
}

Arm decode_arm(std::span<const std::byte> file) {
  Reader header(file.first(std::min(file.size(), header_size)));
  const bool starts_well =
      file.size() >= magic.size() &&
      std::equal(magic.begin(), magic.end(), file.begin(), [](char c, std::byte b) { return static_cast<std::byte>(c) == b; });
  if (!starts_well) {
    throw std::invalid_argument(std::string("it is not an arm file") + advice);
  }
  header.raw(magic.size());
  const auto found = header.integer<std::uint32_t>();
  if (found < oldest_version || found > version) {
    throw std::invalid_argument(
        "it has format version " + std::to_string(found) + ", this Sidestep reads versions " + std::to_string(oldest_version) +
        " to " + std::to_string(version) +
        (found > version ? "; install a newer Sidestep, or prepare the arm again with this one" : advice));
  }
  const auto size = header.integer<std::uint64_t>();
  const auto hash = header.raw(32);
  const auto payload = file.subspan(header_size);
  if (size != payload.size()) {
    throw std::invalid_argument("it holds " + std::to_string(payload.size()) + " bytes of content where " +
                                std::to_string(size) + " must be: it was cut off or changed" + advice);
  }
  if (const Sha256 of_content = sha256(payload); !std::equal(of_content.begin(), of_content.end(), hash.begin())) {
    throw std::invalid_argument(std::string("its content does not have the hash that it states: it is damaged") + advice);
  }
  Reader in(payload);
  Robot robot = in.section("ROBT", [found](Reader& section) { return read_robot(section, found); });
  std::vector<Inertial> inertials = in.section("INRT", read_inertials);
  Body body = in.section("BODY", read_body);
  ArmDetails details;
  details.proof = in.section("PROF", read_proof);
  std::vector<LinkPair> pairs = in.section("PAIR", read_pairs);
  std::vector<ClearanceTable> tables = in.section("TABL", read_tables);
  details.allowed_pairs = in.section("ALLW", read_allowed);
  details.provenance = in.section("PROV", [](Reader& section) {
    Provenance from;
    for (std::string* text : {&from.source, &from.fingerprint, &from.sidestep_version, &from.date}) {
      *text = section.text();
    }
    return from;
  });
  in.expect_end("the payload");
  return Arm(std::move(robot), std::move(body), std::move(pairs), std::move(tables), std::move(inertials), std::move(details));
}

Arm Arm::load(const std::filesystem::path& path) {
  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  std::error_code failed;
  const std::uintmax_t size = stream ? std::filesystem::file_size(path, failed) : 0;
  if (!stream || failed) {
    if (failed) {
      errno = failed.value();
    }
    throw_system_error("cannot read arm file", path);
  }
  try {
    if (size > largest_file) {
      throw std::invalid_argument("it has " + std::to_string(size) + " bytes, too many for an arm" + advice);
    }
    std::vector<char> text(static_cast<std::size_t>(size));
    if (!stream.read(text.data(), static_cast<std::streamsize>(text.size()))) {
      throw_system_error("cannot read arm file", path);
    }
    return decode_arm(std::as_bytes(std::span<const char>(text)));
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument("arm file '" + path.string() + "': " + error.what());
  }
}

std::vector<std::byte> Arm::bytes() const {
  const Content& content = *content_;
  return encode_arm({content.robot, content.body, content.pairs, content.tables, content.inertials, content.details});
}

Arm Arm::from_bytes(std::span<const std::byte> bytes) { return decode_arm(bytes); }

void Arm::save(const std::filesystem::path& path) const {
  TemporaryFile temporary(path);
  errno = 0;
  if (!temporary.write(bytes())) {
    throw_system_error("cannot write arm file", path);
  }
  std::error_code failed;
  std::filesystem::rename(temporary.path(), path, failed);
  if (failed) {
    throw std::system_error(failed, "cannot write arm file '" + path.string() + "'");
  }
}

}  // namespace sidestep
