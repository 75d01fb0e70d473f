#include "common/math/instruction_set.h"

#include <fmt/format.h>
#include <hwy/targets.h>

#include <algorithm>
#include <array>
#include <cstdint>

namespace baton {
namespace {

struct InstructionSet {
  std::string_view name, embree;
  std::int64_t target;
};
constexpr std::array<InstructionSet, 3> kSets{
    {{"sse4", "sse4.2", HWY_SSE4}, {"avx2", "avx2", HWY_AVX2}, {"avx512", "avx512", HWY_AVX3}}};

const InstructionSet*& limit() {
  static const InstructionSet* set = nullptr;
  return set;
}

}  // namespace

Status limit_instruction_set(std::string_view name) {
  if (name == "auto") return {};
  const auto* const set = std::ranges::find(kSets, name, &InstructionSet::name);
  if (set == kSets.end())
    return Error{ErrorKind::usage,
                 fmt::format("--isa {}: expected auto, sse4, avx2 or avx512", name)};
  if ((hwy::SupportedTargets() & set->target) == 0) {
    return Error{ErrorKind::usage,
                 fmt::format("--isa {}: this machine, or this build, does not have it", name)};
  }
  limit() = set;
  // Better targets have lower bits.
  hwy::DisableTargets(set->target - 1);
  return {};
}

std::string embree_isa() {
  return limit() == nullptr ? std::string() : fmt::format(",isa={}", limit()->embree);
}

}  // namespace baton
