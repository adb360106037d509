#include "arm_sections.hpp"

#include <utility>

namespace sidestep {
namespace {

// Fewest bytes of an entry of each list: texts may be empty.
constexpr std::size_t smallest_text = 4, smallest_joint = 4 + 1 + 4 + 15 * 8 + 4 + 2 * 8, smallest_frame = 4 + 4 + 12 * 8;
constexpr std::size_t smallest_inertial = 13 * 8, smallest_component = 4 + (1 + 3 + 9 + 1) * 8;
constexpr std::size_t smallest_pair = 2 * 4, smallest_link_pair = 2 * 4 + 8, smallest_proof = 2 * 4 + 6 * 8;
constexpr std::size_t smallest_table = 2 * 4 + 2 * (4 + 2 * 8 + 1) + 2 * 4;

void write_robot(ArmWriter& out, const Robot& robot) {
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

Robot read_robot(ArmReader& in, std::uint32_t of_version) {
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

void write_inertials(ArmWriter& out, const std::vector<Inertial>& inertials) {
  out.count(inertials.size());
  for (const Inertial& inertial : inertials) {
    out.number(inertial.mass);
    out.numbers(inertial.com);
    out.numbers(inertial.inertia);
  }
}

std::vector<Inertial> read_inertials(ArmReader& in) {
  std::vector<Inertial> inertials(in.count(smallest_inertial));
  for (Inertial& inertial : inertials) {
    inertial.mass = in.number();
    inertial.com = in.numbers(3, 1);
    inertial.inertia = in.numbers(3, 3);
  }
  return inertials;
}

void write_body(ArmWriter& out, const Body& body) {
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

Body read_body(ArmReader& in) {
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

void write_proof(ArmWriter& out, const std::vector<CoverProof>& proof) {
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

std::vector<CoverProof> read_proof(ArmReader& in) {
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

void write_pairs(ArmWriter& out, const std::vector<LinkPair>& pairs) {
  out.count(pairs.size());
  for (const LinkPair& pair : pairs) {
    out.text(pair.first);
    out.text(pair.second);
    out.number(pair.contact);
  }
}

std::vector<LinkPair> read_pairs(ArmReader& in) {
  std::vector<LinkPair> pairs(in.count(smallest_link_pair));
  for (LinkPair& pair : pairs) {
    pair.first = in.text();
    pair.second = in.text();
    pair.contact = in.number();
  }
  return pairs;
}

void write_tables(ArmWriter& out, const std::vector<PairDistanceTable>& tables) {
  out.count(tables.size());
  for (const PairDistanceTable& table : tables) {
    out.text(table.first);
    out.text(table.second);
    for (const PairDistanceTable::Axis& axis : table.axes) {
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

std::vector<PairDistanceTable> read_tables(ArmReader& in) {
  std::vector<PairDistanceTable> tables(in.count(smallest_table));
  for (PairDistanceTable& table : tables) {
    table.first = in.text();
    table.second = in.text();
    for (PairDistanceTable::Axis& axis : table.axes) {
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

void write_allowed(ArmWriter& out, const AllowedPairs& pairs) {
  out.count(pairs.size());
  for (const auto& [first, second] : pairs) {
    out.text(first);
    out.text(second);
  }
}

AllowedPairs read_allowed(ArmReader& in) {
  AllowedPairs pairs(in.count(smallest_pair));
  for (auto& [first, second] : pairs) {
    first = in.text();
    second = in.text();
  }
  return pairs;
}

}  // namespace

void write_content(ArmWriter& out, const ArmParts& arm) {
  out.section("ROBT", [&](ArmWriter& section) { write_robot(section, arm.robot); });
  out.section("INRT", [&](ArmWriter& section) { write_inertials(section, arm.inertials); });
  out.section("BODY", [&](ArmWriter& section) { write_body(section, arm.body); });
  out.section("PROF", [&](ArmWriter& section) { write_proof(section, arm.details.proof); });
  out.section("PAIR", [&](ArmWriter& section) { write_pairs(section, arm.pairs); });
  out.section("TABL", [&](ArmWriter& section) { write_tables(section, arm.tables); });
  out.section("ALLW", [&](ArmWriter& section) { write_allowed(section, arm.details.allowed_pairs); });
}

void write_provenance(ArmWriter& out, const Provenance& from) {
  out.section("PROV", [&](ArmWriter& section) {
    for (const std::string* text : {&from.source, &from.fingerprint, &from.sidestep_version, &from.date}) {
      section.text(*text);
    }
  });
}

Arm read_sections(ArmReader& in, std::uint32_t of_version) {
  Robot robot = in.section("ROBT", [=](ArmReader& section) { return read_robot(section, of_version); });
  std::vector<Inertial> inertials = in.section("INRT", read_inertials);
  Body body = in.section("BODY", read_body);
  ArmDetails details;
  details.proof = in.section("PROF", read_proof);
  std::vector<LinkPair> pairs = in.section("PAIR", read_pairs);
  std::vector<PairDistanceTable> tables = in.section("TABL", read_tables);
  details.allowed_pairs = in.section("ALLW", read_allowed);
  details.provenance = in.section("PROV", [](ArmReader& section) {
    Provenance from;
    for (std::string* text : {&from.source, &from.fingerprint, &from.sidestep_version, &from.date}) {
      *text = section.text();
    }
    return from;
  });
  in.expect_end("the payload");
  return Arm(std::move(robot), std::move(body), std::move(pairs), std::move(tables), std::move(inertials), std::move(details));
}

}  // namespace sidestep
