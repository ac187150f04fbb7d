// Tables in Markdown.
#pragma once

#include <cmath>
#include <cstddef>
#include <iomanip>
#include <ostream>
#include <sstream>
#include <string>
#include <vector>

namespace globalmatch::benchmarks {

using table_row = std::vector<std::string>;

inline std::string fixed(double value, int digits) {
  if (!std::isfinite(value)) return "-";
  std::ostringstream text;
  text << std::fixed << std::setprecision(digits) << value;
  return text.str();
}

/// Not-a-number when there is none.
inline double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / double(values.size());
}

inline void print_row(std::ostream& out, const table_row& cells) {
  for (const std::string& cell : cells) out << "| " << cell << ' ';
  out << "|\n";
}

inline void print_head(std::ostream& out, const table_row& names) {
  out << '\n';
  print_row(out, names);
  for (std::size_t i = 0; i < names.size(); ++i) out << "|---";
  out << "|\n";
}

}  // namespace globalmatch::benchmarks
