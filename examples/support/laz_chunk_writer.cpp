#include "support/laz_chunk_writer.hpp"

#include <algorithm>
#include <utility>

#include "globalmatch/detail/core/threads.hpp"
#include "support/laz_arithmetic_encoder.hpp"
#include "support/laz_item_encoder.hpp"
#include "support/laz_layered_chunk_encoder.hpp"
#include "support/laz_points.hpp"

namespace globalmatch::support::laz {

namespace {

template <class T>
void write_little(std::ostream& out, T value) {
  char bytes[sizeof(T)];
  put_little(bytes, value);
  out.write(bytes, sizeof(T));
}

}  // namespace

// Most of the megabytes of models are never used, and are not initialised.
struct chunk_encoder::models {
  explicit models(const record_layout& layout) {
    if (layout.is_layered())
      layers = std::make_unique<layered_chunk_encoder>(layout);
    else
      items = std::make_unique<item_chunk_encoder>(layout);
  }

  std::unique_ptr<item_chunk_encoder> items;
  std::unique_ptr<layered_chunk_encoder> layers;
};

chunk_encoder::chunk_encoder(const record_layout& layout)
    : layout_(layout), models_(std::make_unique<models>(layout)) {}

chunk_encoder::~chunk_encoder() = default;

void chunk_encoder::encode(std::span<const char> records, std::vector<char>& chunk) {
  if (models_->layers) return models_->layers->encode(records, chunk);
  item_chunk_encoder& items = *models_->items;
  if (layout_.has_color())
    layout_.has_time() ? items.encode<true, true>(records, chunk) : items.encode<false, true>(records, chunk);
  else
    layout_.has_time() ? items.encode<true, false>(records, chunk)
                       : items.encode<false, false>(records, chunk);
}

struct chunk_writer::job {
  explicit job(const record_layout& layout) : encoder(layout) {}
  chunk_encoder encoder;
  std::vector<char> chunk;
};

// The bytes begin with the position of the table, which is not known yet.
chunk_writer::chunk_writer(std::ostream& out, const record_layout& layout, int threads)
    : out_(out), layout_(layout), threads_(threads), begin_(out.tellp()) {
  write_little(out_, std::int64_t(-1));
  const int count = detail::thread_count(execution{.threads = threads});
  for (int i = 0; i < count; ++i) jobs_.push_back(std::make_unique<job>(layout));
}

chunk_writer::~chunk_writer() = default;

void chunk_writer::write(std::span<const char> records) {
  pending_.insert(pending_.end(), records.begin(), records.end());
  while (pending_.size() >= jobs_.size() * chunk_bytes()) compress(jobs_.size());
}

// Compresses and writes as many chunks, of which the last may be a shorter one.
void chunk_writer::compress(std::size_t chunks) {
  const std::span<const char> records(pending_.data(), std::min(pending_.size(), chunks * chunk_bytes()));
  detail::parallel_for(
      execution{.threads = threads_}, "compress points", chunks,
      [&](std::size_t i) {
        const std::size_t begin = i * chunk_bytes();
        jobs_[i]->chunk.clear();
        jobs_[i]->encoder.encode(records.subspan(begin, std::min(chunk_bytes(), records.size() - begin)),
                                 jobs_[i]->chunk);
      },
      1);
  for (std::size_t i = 0; i < chunks; ++i) {
    const std::vector<char>& chunk = jobs_[i]->chunk;
    out_.write(chunk.data(), static_cast<std::streamsize>(chunk.size()));
    sizes_.push_back(static_cast<std::uint32_t>(chunk.size()));
  }
  pending_.erase(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(records.size()));
}

void chunk_writer::finish() {
  if (const std::size_t left = (pending_.size() + chunk_bytes() - 1) / chunk_bytes(); left > 0)
    compress(left);
  const std::streampos table = out_.tellp();
  constexpr std::uint32_t version = 0;
  write_little(out_, version);
  write_little(out_, static_cast<std::uint32_t>(sizes_.size()));
  if (!sizes_.empty()) {
    arithmetic_encoder table_encoder;
    table_encoder.begin();
    const auto numbers = std::make_unique<integer_encoder<32, 2>>();
    numbers->reset();
    std::int32_t last = 0;
    for (const std::uint32_t size : sizes_)
      numbers->encode(table_encoder, std::exchange(last, static_cast<std::int32_t>(size)),
                      static_cast<std::int32_t>(size), 1);
    const std::span<const char> bytes = table_encoder.finish();
    out_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }
  const std::streampos end = out_.tellp();
  out_.seekp(begin_);
  write_little(out_, static_cast<std::int64_t>(table));
  out_.seekp(end);
}

}  // namespace globalmatch::support::laz
