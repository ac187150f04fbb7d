// Internal to the readers: blocks of points that begin with their count, as PTS files have them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "support/input_file.hpp"

namespace globalmatch::support {

/// Compares what blocks announce with what they hold, while a file is read.
class announced_blocks {
 public:
  explicit announced_blocks(const input_file& file) : file_(file) {}

  /// The next block, which begins with its count. Throws `file_error` when the one before holds other than
  /// the points that it announces. Programs write a block for each scan of a project.
  void begin(std::uint64_t count);
  void add_row() { ++rows_; }
  /// The end of the file. Throws `file_error` like `begin` where there are several blocks.
  void end() const;

  /// The sum of all counts; nothing when there is none.
  std::optional<std::uint64_t> announced() const { return sum_; }

 private:
  const input_file& file_;
  std::optional<std::uint64_t> sum_;
  bool has_rows_before_ = false;  // rows came before the first count: these are no blocks
  std::size_t blocks_ = 0;
  std::uint64_t announced_ = 0, rows_ = 0;  // of the last block
};

/// Throws `file_error` when block `number`, counted from 1, holds other than the points it announces.
void require_as_announced(const input_file& file, std::size_t number, std::uint64_t announced,
                          std::uint64_t rows);

}  // namespace globalmatch::support
