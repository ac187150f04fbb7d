#include "support/announced_blocks.hpp"

#include <string>

namespace globalmatch::support {

void announced_blocks::begin(std::uint64_t count) {
  if (blocks_ == 0)
    has_rows_before_ = rows_ > 0;
  else if (!has_rows_before_)
    require_as_announced(file_, blocks_, announced_, rows_);
  sum_ = sum_.value_or(0) + count;
  ++blocks_;
  announced_ = count;
  rows_ = 0;
}

void announced_blocks::end() const {
  if (blocks_ > 1 && !has_rows_before_) require_as_announced(file_, blocks_, announced_, rows_);
}

void require_as_announced(const input_file& file, std::size_t number, std::uint64_t announced,
                          std::uint64_t rows) {
  if (rows == announced) return;
  file.fail("has a block " + std::to_string(number) + " that announces " + std::to_string(announced) +
                " points but holds " + std::to_string(rows),
            rows < announced ? "It is probably truncated: copy or export it again"
                             : "Export it again, or correct the count");
}

}  // namespace globalmatch::support
