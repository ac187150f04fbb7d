#include "support/transform_files.hpp"

#include <string>
#include <string_view>
#include <vector>

#include "support/atomic_file.hpp"
#include "support/input_file.hpp"
#include "support/text_fields.hpp"

namespace globalmatch::support {

namespace {

constexpr std::string_view remedy = "A transform is four lines of four numbers, the last line 0 0 0 1";

/// A line with blanks in place of the commas, semicolons and brackets that some programs write.
std::string without_punctuation(std::string line) {
  for (char& c : line)
    if (std::string_view(",;[]").find(c) != std::string_view::npos) c = ' ';
  return line;
}

std::vector<double> read_numbers(input_file& file) {
  std::vector<double> numbers;
  while (const auto read = file.read_line()) {
    if (trim(*read).starts_with('#')) continue;
    const std::string line = without_punctuation(std::string(*read));
    for (const std::string_view field : split(line, ' ')) {
      if (field.empty()) continue;
      const auto number = to_number(field);
      if (!number)
        file.fail_at_line("has '" + std::string(field.substr(0, 40)) + "' where a number is expected",
                          remedy);
      if (numbers.size() == 16)
        file.fail_at_line("is beyond the 16 numbers of a transform",
                          "Decimals have a point. " + std::string(remedy));
      numbers.push_back(*number);
    }
  }
  return numbers;
}

using failure = std::function<void(const std::string& problem, const std::string& remedy)>;

void require_rotation(const Eigen::Matrix3d& rotation, const failure& fail) {
  constexpr double tolerance = 1e-5;
  const double error = (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(error <= tolerance))
    fail("holds a matrix that is no rotation: its columns are not orthonormal, but off by " +
             std::to_string(error),
         "Scale and shear are not supported; write rotations with 7 digits or more");
  if (rotation.determinant() < 0)
    fail("holds a reflection, not a rotation", "Check the signs and the order of the axes");
}

bool is_transposed(const Eigen::Matrix4d& matrix) {
  return matrix.col(3) == Eigen::Vector4d(0, 0, 0, 1);
}

}  // namespace

void write_transform(const std::filesystem::path& path, const Eigen::Isometry3d& target_from_source) {
  atomic_file file(path);
  const Eigen::Matrix4d& m = target_from_source.matrix();
  for (Eigen::Index row = 0; row < 4; ++row)
    file.stream() << m(row, 0) << ' ' << m(row, 1) << ' ' << m(row, 2) << ' ' << m(row, 3) << '\n';
  file.commit();
}

Eigen::Isometry3d to_transform(std::span<const double> numbers, const failure& fail) {
  const std::string form(remedy);
  if (numbers.size() != 16) fail("holds " + std::to_string(numbers.size()) + " numbers", form);
  Eigen::Isometry3d transform;
  transform.matrix() = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(numbers.data());
  if (!transform.matrix().allFinite()) fail("holds numbers that are not finite", form);
  if (transform.matrix().row(3) != Eigen::RowVector4d(0, 0, 0, 1))
    fail("does not end in the row 0 0 0 1",
         (is_transposed(transform.matrix()) ? "Is it transposed? " : "") + form);
  require_rotation(transform.linear(), fail);
  return transform;
}

Eigen::Isometry3d read_transform(const std::filesystem::path& path) {
  input_file file(path);
  return to_transform(read_numbers(file),
                      [&](const std::string& problem, const std::string& help) { file.fail(problem, help); });
}

}  // namespace globalmatch::support
