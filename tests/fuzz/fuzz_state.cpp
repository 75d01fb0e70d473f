#include "common/state/sample_state.h"
#include "tests/fuzz/section_mending.h"

namespace baton {
namespace {

void look_at(ByteView file) {
  const bool listed = state_sections(file, "fuzz.bst").ok();
  const Result<SampleState> state = decode_state(file, "fuzz.bst");
  if (!state) return;
  BATON_CHECK(listed);
  const Result<SampleState> again = decode_state(encode_state(*state), "again.bst");
  BATON_CHECK(again.ok());
  BATON_CHECK(*again == *state);
}

}  // namespace
}  // namespace baton

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return baton::fuzz_section_file(data, size, baton::look_at);
}
