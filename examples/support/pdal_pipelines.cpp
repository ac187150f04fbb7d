#include "support/pdal_pipelines.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cctype>
#include <limits>
#include <locale>
#include <sstream>
#include <string_view>
#include <system_error>
#include <vector>

#include "support/file_error.hpp"
#include "support/input_file.hpp"
#include "support/numbered_scans.hpp"
#include "support/text_fields.hpp"

namespace globalmatch::support {

namespace {

using json = nlohmann::ordered_json;

bool is_named_text(const std::filesystem::path& path) {
  const std::string extension = lower_case(path.extension().string());
  return extension == ".txt" || extension == ".csv" || extension == ".xyz" || extension == ".asc";
}

// PDAL takes the first line for a header whatever it holds. What separates names is its first character that
// is neither letter, digit nor blank.
bool names_coordinates_to_pdal(std::string_view line) {
  const auto at = std::find_if(line.begin(), line.end(),
                               [](unsigned char c) { return std::isalnum(c) == 0 && c != ' '; });
  const char separator = at == line.end() ? ' ' : *at;
  if (std::string_view(" ,;\t").find(separator) == std::string_view::npos) return false;
  const std::vector<std::string_view> names = split(line, separator);
  const auto has = [&](std::string_view axis) {
    return std::any_of(names.begin(), names.end(), [&](std::string_view n) { return lower_case(n) == axis; });
  };
  return has("x") && has("y") && has("z");
}

json pdal_reader(const std::filesystem::path& source) {
  if (!is_named_text(source)) return source.string();
  return {{"type", "readers.text"}, {"filename", source.string()}};
}

// The options keep PDAL from rounding coordinates to single precision or a few digits.
json pdal_writer(const std::filesystem::path& source) {
  std::string extension = source.extension().string();
  const std::string format = lower_case(extension);
  json writer;
  if (format == ".ply") {
    writer = {{"type", "writers.ply"}, {"storage_mode", "little endian"}};
  } else if (format == ".txt" || format == ".csv" || format == ".xyz") {
    writer = {{"type", "writers.text"}, {"precision", 6}};
  } else {
    writer = {{"type", "writers.las"}, {"forward", "all"},   {"extra_dims", "all"},
              {"offset_x", "auto"},    {"offset_y", "auto"}, {"offset_z", "auto"}};
    constexpr double step = 1e-4;  // [m]; PDAL's is a centimetre where no LAS file gives one
    if (format != ".las" && format != ".laz") {
      writer.update({{"scale_x", step}, {"scale_y", step}, {"scale_z", step}});
      extension = ".laz";
    }
  }
  std::filesystem::path registered = source;
  registered.replace_filename(source.stem().string() + "_registered" + extension);
  writer["filename"] = registered.string();
  return writer;
}

}  // namespace

void require_pdal_source(const std::filesystem::path& path, const std::filesystem::path& source) {
  std::error_code ignored;
  if (parse_scan_name(source).number)
    throw file_error(path, "cannot name scan " + source.string() + " to PDAL, which reads whole files",
                     "Export that scan as a file of its own");
  if (source == "-" || std::filesystem::is_directory(source, ignored))
    throw file_error(path, "is a pipeline of one file, and the source is none: " + source.string(),
                     "Choose another form of the transform, or --write");
  if (!is_named_text(source)) return;
  input_file text(source);
  const auto first_line = text.read_line();
  if (first_line && !names_coordinates_to_pdal(*first_line))
    throw file_error(
        path,
        "is of a text whose first line PDAL takes for a header, and it does not name x, y and z: " +
            quoted(*first_line),
        "Begin " + source.string() + " with such a line, or choose --write");
}

std::string pdal_pipeline(const std::filesystem::path& source, const Eigen::Matrix4d& transform) {
  std::ostringstream numbers;
  numbers.imbue(std::locale::classic());
  numbers.precision(std::numeric_limits<double>::max_digits10);
  for (Eigen::Index i = 0; i < 16; ++i) numbers << (i > 0 ? " " : "") << transform(i / 4, i % 4);
  const json filter = {{"type", "filters.transformation"}, {"matrix", numbers.str()}};
  const json pipeline = json::array({pdal_reader(source), filter, pdal_writer(source)});
  return pipeline.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + '\n';
}

}  // namespace globalmatch::support
