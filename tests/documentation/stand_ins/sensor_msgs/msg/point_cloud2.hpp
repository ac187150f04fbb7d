// The members of the message of ROS 2 that pages read; Debian 12 has no ROS 2.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace sensor_msgs::msg {

struct PointField {
  std::string name;
  std::uint32_t offset;
  std::uint8_t datatype;
  std::uint32_t count;
};

struct PointCloud2 {
  std::uint32_t height, width;
  std::vector<PointField> fields;
  bool is_bigendian;
  std::uint32_t point_step, row_step;
  std::vector<std::uint8_t> data;
  bool is_dense;
};

}  // namespace sensor_msgs::msg
