#include "support/report/view_3d.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>

namespace globalmatch::support {

using json = nlohmann::ordered_json;

namespace {

constexpr double max_integer = 65535;

std::string hexadecimal(const rgb& colour) {
  char text[8];
  std::snprintf(text, sizeof text, "#%02x%02x%02x", unsigned(colour[0]), unsigned(colour[1]),
                unsigned(colour[2]));
  return text;
}

Eigen::AlignedBox3d box_of_points(const std::vector<sampled_point>& points) {
  Eigen::AlignedBox3d box;
  for (const sampled_point& p : points) box.extend(p.position);
  if (box.isEmpty()) box.extend(Eigen::Vector3d(Eigen::Vector3d::Zero()));
  return box;
}

void append_integer(std::vector<unsigned char>& bytes, double value) {
  const auto integer = static_cast<std::uint16_t>(std::lround(std::clamp(value, 0.0, max_integer)));
  bytes.push_back(static_cast<unsigned char>(integer & 0xff));
  bytes.push_back(static_cast<unsigned char>(integer >> 8));
}

json numbers(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

json describe_points(const view_scan& scan) {
  const Eigen::AlignedBox3d box = box_of_points(scan.points);
  const Eigen::Vector3d step = (box.sizes() / max_integer).cwiseMax(1e-6);
  std::vector<unsigned char> bytes;
  for (const sampled_point& p : scan.points) {
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      append_integer(bytes, (p.position[axis] - box.min()[axis]) / step[axis]);
    append_integer(bytes, 100 * p.height);
  }
  return {{"name", scan.name},           {"colour", hexadecimal(scan.colour)},
          {"count", scan.points.size()}, {"low", numbers(box.min())},
          {"step", numbers(step)},       {"points", base64(bytes)}};
}

}  // namespace

json describe_view(std::span<const view_scan> scans, std::span<const view_placement> placements) {
  json view = {{"scans", json::array()}, {"placements", json::array()}};
  for (const view_scan& scan : scans) view["scans"].push_back(describe_points(scan));
  if (scans.empty() || placements.empty()) return view;
  const Eigen::Vector3d middle = placements.front().view_from_scan.front() *
                                 Eigen::Vector3d(box_of_points(scans.front().points).center());
  for (const view_placement& placement : placements) {
    json matrices = json::array();
    for (const Eigen::Isometry3d& view_from_scan : placement.view_from_scan) {
      const Eigen::Matrix4d about_middle = (Eigen::Translation3d(-middle) * view_from_scan).matrix();
      json matrix = json::array();
      for (Eigen::Index r = 0; r < 4; ++r)
        for (Eigen::Index c = 0; c < 4; ++c) matrix.push_back(about_middle(r, c));
      matrices.push_back(std::move(matrix));
    }
    view["placements"].push_back({{"label", placement.label}, {"matrices", std::move(matrices)}});
  }
  return view;
}

std::string base64(std::span<const unsigned char> bytes) {
  constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k) group = group << 8 | (k < count ? bytes[i + k] : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += k <= count ? digits[group >> (18 - 6 * k) & 63u] : '=';
  }
  return text;
}

}  // namespace globalmatch::support
