#include "common/protocol/messages.h"
#include "tests/fuzz/fuzz_target.h"

/// An input is the type and the body of a message, so that inputs outlive versions of the protocol.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace baton;
  const ByteView input = fuzz_input(data, size);
  const std::size_t split = std::min(size, sizeof(std::uint16_t));
  std::vector<Bytes> frames = encode_message(ListJobs{});
  frames[1].assign(input.begin(), input.begin() + static_cast<std::ptrdiff_t>(split));
  frames[2].assign(input.begin() + static_cast<std::ptrdiff_t>(split), input.end());

  // A message whose texts are legible has one form only.
  const Result<Message> message = decode_message(frames);
  if (!message) return 0;
  const std::vector<Bytes> read = encode_message(*message);
  const Result<Message> again = decode_message(read);
  BATON_CHECK(again.ok() && encode_message(*again) == read);
  return 0;
}
