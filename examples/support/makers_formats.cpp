#include "support/makers_formats.hpp"

#include <algorithm>

#include "support/text_fields.hpp"

namespace globalmatch::support {

namespace {

using namespace std::string_view_literals;

struct known_format {
  std::string_view name;
  std::string_view signature;  // at the start of the file; empty where it is not published
  std::string_view extension;  // empty where it is not enough
  std::string_view remedy;
};

constexpr std::string_view from_riscan =
    "Export each scan position from RiSCAN PRO (or RiPROCESS) as E57, LAS or LAZ, in the scanner's own or "
    "the "
    "project's coordinate system";
constexpr std::string_view from_scene = "Export each scan from FARO SCENE as E57 or PTX";
constexpr std::string_view from_laser_control = "Export each scan from Z+F LaserControl as E57 or PTX";
constexpr std::string_view from_cyclone =
    "Export each setup from Leica Cyclone or Cyclone REGISTER 360 as E57 or PTX";
constexpr std::string_view from_realworks = "Export each station from Trimble RealWorks as E57 or LAS";
constexpr std::string_view from_recap = "Export each scan from Autodesk ReCap Pro as E57";
constexpr std::string_view from_cloudcompare =
    "Open it in CloudCompare and save each cloud as PLY, LAS or E57";

constexpr known_format formats[] = {
    {"RIEGL RDB 2", "RIEGL LMS RDB 2 POINTCLOUD FILE", ".rdbx", from_riscan},
    {"RIEGL RXP", "", ".rxp", from_riscan},
    {"RIEGL RiSCAN PRO", "", ".riscan", from_riscan},
    {"RIEGL 3DD", "", ".3dd", from_riscan},
    {"FARO scan", "", ".fls", from_scene},
    {"FARO workspace", "", ".fws", from_scene},
    {"Z+F scan", "", ".zfs", from_laser_control},
    {"Z+F scan", "", ".zfc", from_laser_control},
    {"Leica PTG", "PTG\0\xC7\xA3\x8F\x92"sv, ".ptg", from_cyclone},
    {"Leica PTZ", "", ".ptz", from_cyclone},
    {"Leica LGS", "", ".lgs", from_cyclone},
    {"Leica LGSx", "", ".lgsx", from_cyclone},
    {"Leica Cyclone database", "", ".imp", from_cyclone},
    {"Leica BLK", "", ".b2g", from_cyclone},
    {"Trimble scan", "", ".tzf", from_realworks},
    {"Trimble Data Exchange", "", ".tdx", from_realworks},
    {"Trimble RealWorks project", "", ".rwp", from_realworks},
    {"Autodesk ReCap scan", "", ".rcs", from_recap},
    {"CloudCompare", "CCB", "", from_cloudcompare},
};

bool is_text(std::string_view start) {
  return std::none_of(start.begin(), start.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte < ' ' && c != '\t' && c != '\r' && c != '\n' && c != '\f';
  });
}

makers_format describe_format(const known_format& format) {
  return {"is a " + std::string(format.name) + " file, which this program does not read",
          std::string(format.remedy)};
}

}  // namespace

std::optional<makers_format> recognise_makers_format(std::string_view start,
                                                     const std::filesystem::path& path) {
  if (is_text(start)) return std::nullopt;
  const auto has_signature = [&](const known_format& format) {
    return !format.signature.empty() && start.starts_with(format.signature);
  };
  const known_format* found = std::find_if(std::begin(formats), std::end(formats), has_signature);
  return found == std::end(formats) ? recognise_makers_name(path) : describe_format(*found);
}

std::optional<makers_format> recognise_makers_name(const std::filesystem::path& path) {
  const bool has_name = path.has_filename();  // folder/ has none
  const std::string extension = lower_case((has_name ? path : path.parent_path()).extension().string());
  const known_format* found = std::find_if(
      std::begin(formats), std::end(formats),
      [&](const known_format& format) { return !extension.empty() && extension == format.extension; });
  if (found == std::end(formats)) return std::nullopt;
  return describe_format(*found);
}

}  // namespace globalmatch::support
