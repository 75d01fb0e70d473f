#include "common/state/first_pass_samples.h"
#include "tests/fuzz/section_mending.h"

namespace baton {
namespace {

void look_at(ByteView file) {
  Result<FirstPassSamples> samples = decode_first_pass_samples(file, "fuzz");
  if (!samples) return;
  const auto expect_same_again = [&] {
    const auto again = decode_first_pass_samples(encode_first_pass_samples(*samples), "again");
    BATON_CHECK(again.ok());
    BATON_CHECK(*again == *samples);
  };
  expect_same_again();
  samples->keep_possible(1);
  expect_same_again();
}

}  // namespace
}  // namespace baton

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return baton::fuzz_section_file(data, size, baton::look_at);
}
