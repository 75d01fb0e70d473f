#pragma once

#include <string>
#include <string_view>

#include "common/base/result.h"

namespace baton {

/// Holds this process to an instruction set, so that machines that are not alike make the same
/// bytes: "sse4", "avx2" or "avx512"; "auto": the best that the machine has. To be called before
/// anything is computed. Errors, usage: another name, or a set that this machine or build lacks.
Status limit_instruction_set(std::string_view name);

/// Of the device that Embree is to make: ",isa=avx2", or empty.
std::string embree_isa();

}  // namespace baton
