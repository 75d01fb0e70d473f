#include "common/image/cryptomatte.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "common/base/check.h"
#include "common/math/murmur3.h"

namespace baton {
namespace {

/// MurmurHash3 of a text, 32 bits [Appleby 2011].
std::uint32_t hash_of(std::string_view text) {
  const auto byte = [&](std::size_t i) {
    return std::uint32_t{static_cast<std::uint8_t>(text[i])};
  };
  std::uint32_t hash = 0;
  const std::size_t whole = text.size() / 4 * 4;
  for (std::size_t i = 0; i < whole; i += 4)
    hash = murmur3::added(hash, byte(i) | byte(i + 1) << 8 | byte(i + 2) << 16 | byte(i + 3) << 24);
  std::uint32_t rest = 0;
  for (std::size_t i = text.size(); i > whole; --i) rest = rest << 8 | byte(i - 1);
  hash ^= murmur3::scrambled(rest);
  return murmur3::finished(hash ^ static_cast<std::uint32_t>(text.size()));
}

/// A name in a JSON text.
std::string json_text(std::string_view name) {
  std::string text = "\"";
  for (const char c : name) {
    if (c == '"' || c == '\\') text += '\\';
    text += c;
  }
  return text + '"';
}

}  // namespace

float cryptomatte_id(std::string_view name) {
  std::uint32_t hash = hash_of(name);
  const std::uint32_t exponent = hash >> 23 & 255;
  if (exponent == 0 || exponent == 255) hash ^= 1u << 23;
  return std::bit_cast<float>(hash);
}

CryptoLayer::CryptoLayer(FilmTile& film, const std::vector<std::string>& channels) {
  for (const std::string& channel : channels) {
    planes_.push_back(film.find(channel));
    BATON_CHECK(planes_.back() != nullptr);
  }
}

void CryptoLayer::write(std::size_t pixel, std::vector<CryptoShare>& shares) const {
  std::sort(shares.begin(), shares.end(), [](const CryptoShare& a, const CryptoShare& b) {
    if (a.share != b.share) return a.share > b.share;
    return std::bit_cast<std::uint32_t>(a.id) < std::bit_cast<std::uint32_t>(b.id);
  });
  for (std::size_t rank = 0; rank < planes_.size() / 2; ++rank) {
    const CryptoShare thing = rank < shares.size() ? shares[rank] : CryptoShare{};
    planes_[2 * rank][pixel] = thing.id;
    planes_[2 * rank + 1][pixel] = thing.share;
  }
}

void CryptoLayer::add_to(std::size_t pixel, double factor,
                         std::map<std::uint32_t, double>& sums) const {
  for (std::size_t i = 0; i < planes_.size(); i += 2) {
    const float share = planes_[i + 1][pixel];
    if (share > 0) sums[std::bit_cast<std::uint32_t>(planes_[i][pixel])] += factor * double{share};
  }
}

void merge_cryptomatte(FilmTile& earlier, double weight, const std::vector<std::string>& channels,
                       FilmTile& film) {
  if (film.find(channels.front()) == nullptr) return;
  const CryptoLayer before(earlier, channels), now(film, channels);
  std::map<std::uint32_t, double> sums;
  std::vector<CryptoShare> shares;
  for (std::size_t pixel = 0; pixel < film.num_pixels(); ++pixel) {
    sums.clear();
    before.add_to(pixel, weight, sums);
    now.add_to(pixel, 1, sums);
    shares.clear();
    for (const auto& [bits, sum] : sums)
      shares.push_back({std::bit_cast<float>(bits), static_cast<float>(sum / (weight + 1))});
    now.write(pixel, shares);
  }
}

ImageMetadata cryptomatte_metadata(std::string_view layer, const std::vector<std::string>& names) {
  const auto bits = [](std::string_view name) {
    return std::bit_cast<std::uint32_t>(cryptomatte_id(name));
  };
  std::string manifest = "{";
  for (const std::string& name : names) {
    manifest +=
        fmt::format("{}{}:\"{:08x}\"", manifest.size() > 1 ? "," : "", json_text(name), bits(name));
  }
  manifest += "}";
  const std::string key =
      fmt::format("cryptomatte/{}/", fmt::format("{:08x}", hash_of(layer)).substr(0, 7));
  return {{key + "name", std::string(layer)},
          {key + "hash", "MurmurHash3_32"},
          {key + "conversion", "uint32_to_float32"},
          {key + "manifest", manifest}};
}

}  // namespace baton
