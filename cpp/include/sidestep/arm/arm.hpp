#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "sidestep/body/body.hpp"
#include "sidestep/clearance/pair_distance_table.hpp"
#include "sidestep/body/link_pair.hpp"
#include "sidestep/robot/robot.hpp"
#include "sidestep/robot/dynamics.hpp"

namespace sidestep {

/// Proof and measures of the ellipsoids that cover one link.
struct CoverProof {
  std::string link;
  double coverage = 0.0;           ///< Share of the mesh's area proven to lie inside the ellipsoids; 1 for a cover.
  double mean_overshoot = 0.0;     ///< Mean distance of the ellipsoids' outer surface from the mesh [m].
  double max_overshoot = 0.0;      ///< Largest distance of that surface from the mesh [m].
  double volume_ratio = 0.0;       ///< Volume of the ellipsoids over that of the mesh or of its convex hull.
  std::string volume_of;           ///< Reference of `volume_ratio`: "mesh" or "hull".
  double interior_coverage = 0.0;  ///< Share of the link's inside that lies in the ellipsoids.
  double slimness = 0.0;           ///< Least ratio of shortest to longest semi-axis.
};

/// Where an arm comes from. Does not count for its content hash.
struct Provenance {
  std::string source;            ///< Name of the description: a file name or a shipped robot.
  std::string fingerprint;       ///< Hash of the kinematics and meshes that the body was made from.
  std::string sidestep_version;  ///< Version that prepared it.
  std::string date;              ///< Date of the preparation, ISO 8601.
};

/// Details of an arm that control does not need.
struct ArmDetails {
  std::vector<CoverProof> proof;                                   ///< One proof per covered link.
  std::vector<std::pair<std::string, std::string>> allowed_pairs;  ///< Pairs of links that may touch.
  Provenance provenance;
};

/// Model of a robot, prepared once: kinematic tree, limits, inertias, frames, covering body with its proof, pairs of links
/// that must not touch, clearance tables.
///
/// An immutable value; copies share their content. `save` and `load` use one binary file (`.arm`) that needs no mesh,
/// no URDF and no Python.
class Arm {
 public:
  /// `inertials`: one per joint in the frame of the joint's child, or empty for an arm without dynamics.
  /// Throws std::invalid_argument that names what is wrong: a body that is not calibrated, an unknown link, a table or
  /// an inertia that does not suit the robot.
  Arm(Robot robot, Body body, std::vector<LinkPair> pairs, std::vector<PairDistanceTable> tables,
      std::vector<Inertial> inertials, ArmDetails details = {});

  /// Reads an `.arm` file. Throws std::system_error if the file cannot be read, and std::invalid_argument that names
  /// the file, what is wrong with it and what to do: not an arm file, cut off, damaged, of a newer version,
  /// inconsistent.
  static Arm load(const std::filesystem::path& path);

  /// Writes an `.arm` file in one piece: a reader sees the old file or the new one. Throws std::system_error.
  void save(const std::filesystem::path& path) const;

  /// The bytes of an `.arm` file.
  std::vector<std::byte> bytes() const;
  /// The arm of such bytes. Throws std::invalid_argument that says what is wrong and what to do.
  static Arm from_bytes(std::span<const std::byte> bytes);

  const std::string& name() const noexcept { return robot().name(); }
  int num_coordinates() const noexcept { return robot().num_coordinates(); }
  const Robot& robot() const noexcept { return content_->robot; }
  const Body& body() const noexcept { return content_->body; }
  const std::vector<LinkPair>& pairs() const noexcept { return content_->pairs; }
  const std::vector<PairDistanceTable>& tables() const noexcept { return content_->tables; }
  const std::vector<Inertial>& inertials() const noexcept { return content_->inertials; }
  bool has_dynamics() const noexcept { return !content_->inertials.empty(); }
  const std::vector<CoverProof>& proof() const noexcept { return content_->details.proof; }
  const std::vector<std::pair<std::string, std::string>>& allowed_pairs() const noexcept {
    return content_->details.allowed_pairs;
  }
  const Provenance& provenance() const noexcept { return content_->details.provenance; }

  /// SHA-256 (64 hex digits) of everything but the provenance: equal arms have equal hashes.
  const std::string& content_hash() const noexcept { return content_->hash; }

  /// Mass matrix and bias, with standard gravity. Throws std::invalid_argument if the arm has no inertias.
  RigidBodyDynamics dynamics() const;

  /// A configuration (nv) inside the limits: the middle of each interval, 0 without limits.
  Eigen::VectorXd neutral() const;

 private:
  struct Content {
    Robot robot;
    Body body;
    std::vector<LinkPair> pairs;
    std::vector<PairDistanceTable> tables;
    std::vector<Inertial> inertials;
    ArmDetails details;
    std::string hash;
  };
  std::shared_ptr<const Content> content_;
};

}  // namespace sidestep
