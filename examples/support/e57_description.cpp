#include "support/e57_description.hpp"

#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <limits>
#include <locale>
#include <sstream>
#include <string_view>
#include <utility>

#include "support/text_fields.hpp"

// Builds for other machines have no pugixml, which is not a library of headers alone; where its header is
// found even so, the build says that there is nothing to link.
#if __has_include(<pugixml.hpp>) && !defined(GLOBALMATCH_WITHOUT_PUGIXML)
#include <pugixml.hpp>

namespace globalmatch::support {

struct e57_description::document {
  pugi::xml_document xml;
  std::vector<pugi::xml_node> scans;
};

namespace {

// A number that an element has as its text, 0 if it has none; or that an attribute is.
double number_in(const e57_pages& pages, std::string_view name, std::string_view text, double if_empty) {
  text = trim(text);
  if (text.empty()) return if_empty;
  const auto value = to_number(text);
  if (!value) pages.fail_damaged("has " + quoted(text) + " as number '" + std::string(name) + "'");
  return *value;
}

std::int64_t integer_in(const e57_pages& pages, const pugi::xml_attribute& attribute, std::int64_t if_none) {
  if (!attribute) return if_none;
  const std::string_view text = trim(attribute.value());
  std::int64_t value = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || stop != text.data() + text.size())
    pages.fail_damaged("has " + quoted(text) + " as integer '" + attribute.name() + "'");
  return value;
}

std::uint64_t count_in(const e57_pages& pages, const pugi::xml_node& node, const char* name) {
  const auto count = to_count(trim(node.attribute(name).value()));
  if (!count) pages.fail_damaged("has points without a valid '" + std::string(name) + "'");
  return *count;
}

// The pose of a scan; none where the file has no rotation and translation that are rigid.
std::optional<Eigen::Isometry3d> pose_of(const e57_pages& pages, const pugi::xml_node& pose) {
  if (!pose) return std::nullopt;
  const auto number = [&](const pugi::xml_node& parent, const char* name) {
    return number_in(pages, name, parent.child(name).text().get(), 0);
  };
  const pugi::xml_node rotation = pose.child("rotation"), translation = pose.child("translation");
  auto turn = Eigen::Quaterniond::Identity();
  if (rotation)
    turn = Eigen::Quaterniond(number(rotation, "w"), number(rotation, "x"), number(rotation, "y"),
                              number(rotation, "z"));
  const Eigen::Vector3d shift(number(translation, "x"), number(translation, "y"), number(translation, "z"));
  constexpr double rounding = 1e-3;  // of a quaternion with few digits
  if (!(std::abs(turn.norm() - 1) < rounding) || !shift.allFinite()) return std::nullopt;
  return Eigen::Translation3d(shift) * turn.normalized();
}

// Not a stream, which pugixml knows of one standard library alone.
struct text_writer final : pugi::xml_writer {
  std::string text;
  void write(const void* data, std::size_t size) override {
    text.append(static_cast<const char*>(data), size);
  }
};

// Appends a number as an element of the format, with the same bits when it is read.
void append_number(pugi::xml_node& parent, const char* name, double value) {
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text.precision(std::numeric_limits<double>::max_digits10);
  text << value;
  pugi::xml_node element = parent.append_child(name);
  element.append_attribute("type") = "Float";
  element.text().set(text.str().c_str());
}

void set_pose(pugi::xml_node& of, const Eigen::Isometry3d& survey_from_file) {
  of.remove_child("pose");
  pugi::xml_node pose = of.prepend_child("pose");
  pugi::xml_node rotation = pose.append_child("rotation"), translation = pose.append_child("translation");
  for (pugi::xml_node* structure : {&pose, &rotation, &translation})
    structure->append_attribute("type") = "Structure";
  const Eigen::Quaterniond q(survey_from_file.linear());
  append_number(rotation, "w", q.w());
  append_number(rotation, "x", q.x());
  append_number(rotation, "y", q.y());
  append_number(rotation, "z", q.z());
  append_number(translation, "x", survey_from_file.translation().x());
  append_number(translation, "y", survey_from_file.translation().y());
  append_number(translation, "z", survey_from_file.translation().z());
}

// The pictures of a scan, which have poses of their own, move with it.
void move_pictures(const e57_pages& pages, pugi::xml_node pictures, std::string_view guid_of_scan,
                   const Eigen::Isometry3d& change) {
  for (pugi::xml_node picture : pictures.children()) {
    if (guid_of_scan.empty() || picture.child("associatedData3DGuid").text().get() != guid_of_scan) continue;
    const auto pose = pose_of(pages, picture.child("pose"));
    set_pose(picture, change * pose.value_or(Eigen::Isometry3d::Identity()));
  }
}

e57_field field_of(const e57_pages& pages, const pugi::xml_node& node, std::size_t stream) {
  e57_field field;
  field.stream = stream;
  const std::string_view type = node.attribute("type").value();
  if (type == "Float") {
    const bool is_single = std::string_view(node.attribute("precision").value()) == "single";
    field.type = is_single ? e57_field::number::float32 : e57_field::number::float64;
    field.bits = is_single ? 32 : 64;
  } else if (type == "Integer" || type == "ScaledInteger") {
    using limits = std::numeric_limits<std::int64_t>;
    field.type = e57_field::number::integer;
    field.minimum = integer_in(pages, node.attribute("minimum"), limits::min());
    const std::int64_t maximum = integer_in(pages, node.attribute("maximum"), limits::max());
    if (maximum < field.minimum)
      pages.fail_damaged("has a maximum below the minimum in '" + std::string(node.name()) + "'");
    field.bits = static_cast<unsigned>(
        std::bit_width(static_cast<std::uint64_t>(maximum) - static_cast<std::uint64_t>(field.minimum)));
    if (type == "ScaledInteger") {
      field.scale = number_in(pages, "scale", node.attribute("scale").value(), 1);
      field.offset = number_in(pages, "offset", node.attribute("offset").value(), 0);
      if (field.scale == 0 || !std::isfinite(field.scale) || !std::isfinite(field.offset))
        pages.fail_damaged("has a scale or an offset that is no number in " + quoted(node.name()));
    }
  } else {
    pages.fail_damaged("has " + quoted(node.name()) + " of type " + quoted(type) + ", which is no number");
  }
  return field;
}

// The elements of the prototype that hold values, each of which has a byte stream. Without recursion, because
// a damaged file may nest elements to any depth.
std::vector<pugi::xml_node> leaves_of(const pugi::xml_node& prototype) {
  struct collector final : pugi::xml_tree_walker {
    bool for_each(pugi::xml_node& node) override {
      const std::string_view type = node.attribute("type").value();
      if (node.type() == pugi::node_element && type != "Structure" && type != "Vector")
        leaves.push_back(node);
      return true;
    }
    std::vector<pugi::xml_node> leaves;
  };
  collector all;
  pugi::xml_node(prototype).traverse(all);
  return all.leaves;
}

// The streams of x, y and z, or of what else the names are; nothing unless there are all of them.
std::optional<std::array<std::size_t, 3>> find_all(const std::vector<pugi::xml_node>& leaves,
                                                   const std::array<std::string_view, 3>& names) {
  std::array<std::size_t, 3> found;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto is_named = [&](const pugi::xml_node& leaf) { return names[axis] == leaf.name(); };
    const auto leaf = std::find_if(leaves.begin(), leaves.end(), is_named);
    if (leaf == leaves.end()) return std::nullopt;
    found[axis] = static_cast<std::size_t>(leaf - leaves.begin());
  }
  return found;
}

void add_attribute(const e57_pages& pages, const pugi::xml_node& leaf, std::size_t stream, e57_scan& scan) {
  scan.attributes.emplace_back(leaf.name());
  if (std::string_view(leaf.attribute("type").value()) != "String")
    scan.numbers.emplace_back(leaf.name(), field_of(pages, leaf, stream));
}

// Which fields are the coordinates. Cartesian ones are preferred, as they need no conversion.
void find_coordinates(const e57_pages& pages, const std::vector<pugi::xml_node>& leaves, e57_scan& scan) {
  auto found = find_all(leaves, {"cartesianX", "cartesianY", "cartesianZ"});
  scan.is_spherical = !found;
  if (!found) found = find_all(leaves, {"sphericalRange", "sphericalAzimuth", "sphericalElevation"});
  if (!found)
    pages.fail("has a scan with neither Cartesian nor spherical coordinates",
               "Export the scan again with its coordinates, as E57, PLY or LAS");
  for (std::size_t axis = 0; axis < 3; ++axis)
    scan.coordinates[axis] = field_of(pages, leaves[(*found)[axis]], (*found)[axis]);
  const std::string_view state = scan.is_spherical ? "sphericalInvalidState" : "cartesianInvalidState";
  for (std::size_t i = 0; i < leaves.size(); ++i) {
    if (state == leaves[i].name())
      scan.invalid_state = field_of(pages, leaves[i], i);
    else if (std::find(found->begin(), found->end(), i) == found->end())
      add_attribute(pages, leaves[i], i, scan);
  }
}

// The standard names one codec, which every writer uses, whether it lists it or not.
void require_known_codecs(const e57_pages& pages, const pugi::xml_node& points) {
  for (const pugi::xml_node& codec : points.child("codecs").children())
    if (codec.type() == pugi::node_element && !codec.child("bitPackCodec"))
      pages.fail("has points that are compressed by a codec which this program does not know",
                 "Export the scan again without that compression, or as PLY or LAS");
}

}  // namespace

e57_description::e57_description(const e57_pages& pages)
    : pages_(pages), document_(std::make_unique<document>()) {
  const std::string xml = pages.read_xml();
  if (const auto result = document_->xml.load_buffer(xml.data(), xml.size()); !result)
    pages.fail_damaged("has a description of its scans that is no XML (" + std::string(result.description()) +
                       ")");
  const pugi::xml_node root = document_->xml.child("e57Root");
  if (!root) pages.fail_damaged("has a description without 'e57Root'");
  for (const pugi::xml_node& scan : root.child("data3D").children())
    if (scan.child("points")) document_->scans.push_back(scan);
}

std::size_t e57_description::scans() const {
  return document_->scans.size();
}

void e57_description::require_scan(std::size_t number) const {
  if (scans() == 0) pages_.fail("holds no scan", "Export the scans, and not only pictures or positions");
  if (number == 0 || number > scans())
    pages_.fail("holds " + std::to_string(scans()) + " scans, and no scan " + std::to_string(number),
                "Scans are counted from 1");
}

e57_scan e57_description::scan(std::size_t number) const {
  require_scan(number);
  const pugi::xml_node node = document_->scans[number - 1], points = node.child("points");
  require_known_codecs(pages_, points);
  e57_scan scan;
  scan.section = count_in(pages_, points, "fileOffset");
  scan.size = count_in(pages_, points, "recordCount");
  // No coordinates take less than a bit, and no writer's less than a byte: this bounds what else is
  // allocated.
  if (scan.size > pages_.size())
    pages_.fail("announces " + std::to_string(scan.size) + " points, more than it has bytes",
                "It is probably truncated, or all of its points are at one place: export it again");
  const std::vector<pugi::xml_node> leaves = leaves_of(points.child("prototype"));
  scan.streams = leaves.size();
  find_coordinates(pages_, leaves, scan);
  scan.pose = pose_of(pages_, node.child("pose"));
  return scan;
}

std::string e57_description::xml_with_poses(std::span<const scan_pose> poses) const {
  for (const scan_pose& pose : poses) require_scan(pose.number);
  pugi::xml_document changed;
  changed.reset(document_->xml);
  pugi::xml_node declaration = changed.prepend_child(pugi::node_declaration);
  declaration.append_attribute("version") = "1.0";
  declaration.append_attribute("encoding") = "UTF-8";
  pugi::xml_node root = changed.child("e57Root");
  std::size_t count = 0;
  for (pugi::xml_node scan : root.child("data3D").children()) {
    if (!scan.child("points")) continue;
    ++count;
    const auto pose =
        std::find_if(poses.begin(), poses.end(), [&](const scan_pose& p) { return p.number == count; });
    if (pose == poses.end()) continue;
    const auto before = pose_of(pages_, scan.child("pose"));
    set_pose(scan, pose->survey_from_file);
    move_pictures(pages_, root.child("images2D"), scan.child("guid").text().get(),
                  pose->survey_from_file * before.value_or(Eigen::Isometry3d::Identity()).inverse());
  }
  text_writer writer;
  changed.save(writer, "", pugi::format_raw | pugi::format_no_declaration);
  while (writer.text.size() % 4 != 0) writer.text += '\n';  // sections begin at multiples of four bytes
  return std::move(writer.text);
}

}  // namespace globalmatch::support

#else

namespace globalmatch::support {

struct e57_description::document {};

e57_description::e57_description(const e57_pages& pages) : pages_(pages) {
  pages.fail("is an E57 file, and this program was built without pugixml, which reads them",
             "Install pugixml and build the program again, or export the scan as PLY or LAS");
}

std::size_t e57_description::scans() const {
  return 0;
}

e57_scan e57_description::scan(std::size_t) const {
  return {};
}

std::string e57_description::xml_with_poses(std::span<const scan_pose>) const {
  return {};
}

}  // namespace globalmatch::support

#endif

globalmatch::support::e57_description::~e57_description() = default;
