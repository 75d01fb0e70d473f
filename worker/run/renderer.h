#pragma once

#include <string>

namespace baton {

/// What decides the bytes of pixels beside the build, e.g. "AVX2, Embree 3.13.5": the instruction
/// set in use, to be limited before the first call, and the ray tracer.
const std::string& describe_renderer();

}  // namespace baton
