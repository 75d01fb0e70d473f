#include "common/image/cryptomatte.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <map>

#include "common/base/check.h"

namespace baton {
namespace {

/// [Appleby 2011]
std::uint32_t murmur3(std::string_view text) {
  constexpr std::uint32_t kFirst = 0xcc9e2d51, kSecond = 0x1b873593;
  std::uint32_t hash = 0;
  const auto byte = [&](std::size_t i) {
    return std::uint32_t{static_cast<std::uint8_t>(text[i])};
  };
  const auto mixed = [&](std::uint32_t k) { return std::rotl(k * kFirst, 15) * kSecond; };
  const std::size_t whole = text.size() / 4 * 4;
  for (std::size_t i = 0; i < whole; i += 4) {
    hash ^= mixed(byte(i) | byte(i + 1) << 8 | byte(i + 2) << 16 | byte(i + 3) << 24);
    hash = std::rotl(hash, 13) * 5 + 0xe6546b64;
  }
  std::uint32_t rest = 0;
  for (std::size_t i = text.size(); i > whole; --i) rest = rest << 8 | byte(i - 1);
  if (whole < text.size()) hash ^= mixed(rest);
  hash ^= static_cast<std::uint32_t>(text.size());
  hash = (hash ^ hash >> 16) * 0x85ebca6b;
  hash = (hash ^ hash >> 13) * 0xc2b2ae35;
  return hash ^ hash >> 16;
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

std::vector<float*> planes_of(FilmTile& film, const std::vector<std::string>& channels) {
  std::vector<float*> planes;
  for (const std::string& channel : channels) {
    planes.push_back(film.find(channel));
    BATON_CHECK(planes.back() != nullptr);
  }
  return planes;
}

void sort_shares(std::vector<CryptoShare>& shares) {
  std::sort(shares.begin(), shares.end(), [](const CryptoShare& a, const CryptoShare& b) {
    if (a.share != b.share) return a.share > b.share;
    return std::bit_cast<std::uint32_t>(a.id) < std::bit_cast<std::uint32_t>(b.id);
  });
}

void write_shares(const std::vector<float*>& planes, std::size_t pixel,
                  const std::vector<CryptoShare>& shares) {
  for (std::size_t rank = 0; rank < planes.size() / 2; ++rank) {
    const bool is_there = rank < shares.size();
    planes[2 * rank][pixel] = is_there ? shares[rank].id : 0;
    planes[2 * rank + 1][pixel] = is_there ? shares[rank].share : 0;
  }
}

}  // namespace

float cryptomatte_id(std::string_view name) {
  std::uint32_t hash = murmur3(name);
  const std::uint32_t exponent = hash >> 23 & 255;
  if (exponent == 0 || exponent == 255) hash ^= 1u << 23;
  return std::bit_cast<float>(hash);
}

void write_cryptomatte(FilmTile& film, const std::vector<std::string>& channels, std::size_t pixel,
                       std::vector<CryptoShare>& shares) {
  sort_shares(shares);
  write_shares(planes_of(film, channels), pixel, shares);
}

void merge_cryptomatte(const FilmTile& earlier, double weight,
                       const std::vector<std::string>& channels, FilmTile& film) {
  if (film.find(channels.front()) == nullptr) return;
  const std::vector<float*> now = planes_of(film, channels);
  std::vector<const float*> before;
  for (const std::string& channel : channels) before.push_back(earlier.find(channel));
  std::vector<CryptoShare> shares;
  for (std::size_t pixel = 0; pixel < film.num_pixels(); ++pixel) {
    std::map<std::uint32_t, double> sums;  // by the ID's bits
    const auto add = [&](float id, float share, double factor) {
      if (share > 0) sums[std::bit_cast<std::uint32_t>(id)] += factor * double{share};
    };
    for (std::size_t i = 0; i < channels.size(); i += 2) {
      add(before[i][pixel], before[i + 1][pixel], weight);
      add(now[i][pixel], now[i + 1][pixel], 1);
    }
    shares.clear();
    for (const auto& [bits, sum] : sums)
      shares.push_back({std::bit_cast<float>(bits), static_cast<float>(sum / (weight + 1))});
    sort_shares(shares);
    write_shares(now, pixel, shares);
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
      fmt::format("cryptomatte/{}/", fmt::format("{:08x}", murmur3(layer)).substr(0, 7));
  return {{key + "name", std::string(layer)},
          {key + "hash", "MurmurHash3_32"},
          {key + "conversion", "uint32_to_float32"},
          {key + "manifest", manifest}};
}

}  // namespace baton
