#include "support/laz_layout.hpp"

#include <cstdint>

namespace globalmatch::support::laz {

std::vector<laszip_record::item> laszip_items(const record_layout& layout) {
  const auto version = static_cast<std::uint16_t>(layout.is_layered() ? layout.version : 2);
  std::vector<laszip_record::item> items;
  if (layout.is_layered()) {
    items.push_back({10, 30, version});
    if (layout.has_infrared()) items.push_back({12, 8, version});
    if (layout.has_color() && !layout.has_infrared()) items.push_back({11, 6, version});
  } else {
    items.push_back({6, 20, version});
    if (layout.has_time()) items.push_back({7, 8, version});
    if (layout.has_color()) items.push_back({8, 6, version});
  }
  const std::uint16_t bytes = layout.is_layered() ? 14 : 0;
  if (layout.extra_bytes > 0)
    items.push_back({bytes, static_cast<std::uint16_t>(layout.extra_bytes), version});
  return items;
}

}  // namespace globalmatch::support::laz
