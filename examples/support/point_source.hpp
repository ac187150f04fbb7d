// What a reader of scans gives: points that are decoded when they are asked for.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "support/point_attributes.hpp"

namespace globalmatch {
struct execution;
}  // namespace globalmatch

namespace globalmatch::support {

struct class_counts;

/// How many points a file marks as no good: LAS classes 7 and 18 (noise), and others with the withheld flag.
struct marked_points {
  std::size_t noise = 0;
  std::size_t withheld = 0;
};

/// The points of a scan, in the order and the frame of its file. All functions may be called by several
/// threads at once.
class point_source {
 public:
  /// Points that are best read together, beginning at a multiple of it.
  static constexpr std::size_t block_size = 4096;

  virtual ~point_source() = default;
  virtual std::size_t size() const = 0;

  /// Decodes the points [first, first + points.size()). Points that are left out, because the file marks them
  /// or they have no coordinates, are not-a-number. Throws `file_error` when the file is damaged there.
  virtual void read(std::size_t first, std::span<Eigen::Vector3d> points) const = 0;

  /// What `read_attributes` gives of each point.
  virtual std::vector<attribute> attributes() const { return {}; }

  /// Fills the columns with the attributes that they ask for, of the points [first, first + count), also of
  /// those that are left out. Throws `file_error` when the file is damaged there.
  virtual void read_attributes(std::size_t, std::size_t, std::span<attribute_column>) const {}

  /// The points that the file marks, among those in whole blocks that were read so far.
  virtual marked_points marked() const { return {}; }

  /// Counts return numbers and classes of all points, also of those that are left out, in a pass of its own;
  /// nothing where the file has neither. The same for any number of threads. Throws `file_error`.
  virtual std::optional<class_counts> count_classes(const execution& exec) const;
};

/// Points that were decoded at once, and their attributes if those were wanted.
class points_in_memory final : public point_source {
 public:
  explicit points_in_memory(std::vector<Eigen::Vector3d> points, attribute_table attributes = {})
      : points_(std::move(points)), attributes_(std::move(attributes)) {}

  std::size_t size() const override { return points_.size(); }
  void read(std::size_t first, std::span<Eigen::Vector3d> points) const override {
    const auto at = points_.begin() + static_cast<std::ptrdiff_t>(first);
    std::copy(at, at + static_cast<std::ptrdiff_t>(points.size()), points.begin());
  }
  std::vector<attribute> attributes() const override { return attributes_.attributes(); }
  void read_attributes(std::size_t first, std::size_t count,
                       std::span<attribute_column> columns) const override {
    attributes_.read(first, count, columns);
  }

 private:
  std::vector<Eigen::Vector3d> points_;
  attribute_table attributes_;
};

/// How to read a scan.
struct scan_options {
  bool keep_marked = false;  ///< points that the file marks as noise or withheld are kept, too
  bool attributes = false;   ///< text is read with its attributes; others read theirs when asked
  bool tiles = false;        ///< a folder is one scan, whose files are tiles in one frame
  int threads = 0;           ///< that decode compressed points; 0: all
  std::uint64_t memory = std::uint64_t(4) << 30;  ///< [bytes] for decoded points; if they take more, they are
                                                  ///< decoded in every pass
};

/// What a LAS file says about all of its points, which one that is written from it repeats.
struct las_frame {
  Eigen::Vector3d scale, offset;  ///< of coordinates, which are integers * scale + offset
  unsigned format = 0;            ///< of the point records
  std::uint16_t encoding = 0;     ///< bits: what kind of time the GPS time is, how the projection is given
  std::vector<std::pair<std::uint16_t, std::string>> projection = {};  ///< records of LASF_Projection
};

/// What a file says about its scan besides the points.
struct scan_header {
  std::string format = {};                     ///< with version, as "LAS 1.4, point format 6"
  std::optional<Eigen::Isometry3d> pose = {};  ///< survey_from_file; reported, not applied
  std::vector<std::string> attributes = {};    ///< of each point besides x, y and z, as the file names them
  std::optional<las_frame> las = {};
  std::vector<std::string> notes = {};  ///< what is odd about the file, and how it was read
};

/// The note on points behind those that a header announces, which are not read.
std::string note_on_more_points(std::uint64_t announced, std::string_view more);

/// A scan as a reader opens it.
struct opened_scan {
  std::unique_ptr<point_source> points;
  scan_header header = {};
  std::size_t scans = 1;  ///< that the file holds
};

}  // namespace globalmatch::support
