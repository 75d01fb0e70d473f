#include "common/state/first_pass_samples.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>

#include "tests/support/first_pass.h"

namespace baton {
namespace {

using testing::HasSubstr;

TEST(FirstPassSamples, ComeBackAsTheyWere) {
  FirstPassSamples s = test::small_first_pass();
  EXPECT_EQ(*decode_first_pass_samples(encode_first_pass_samples(s), "test"), s);
  s.lns.assign(40, 1.5f);
  EXPECT_EQ(*decode_first_pass_samples(encode_first_pass_samples(s), "test"), s);
}

TEST(FirstPassSamples, AnyChangedByteIsAnError) {
  const Bytes bytes = encode_first_pass_samples(test::small_first_pass());
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    Bytes broken = bytes;
    broken[i] ^= std::byte{0x10};
    EXPECT_FALSE(decode_first_pass_samples(broken, "test").ok()) << i;
  }
}

TEST(FirstPassSamples, ValuesOutOfRangeAreNamed) {
  const auto message = [](const FirstPassSamples& s) {
    const auto decoded = decode_first_pass_samples(encode_first_pass_samples(s), "tile 7");
    return decoded.ok() ? std::string("no error") : decoded.error().message;
  };
  FirstPassSamples s = test::small_first_pass();
  s.slot[1] = s.slot[0];
  EXPECT_THAT(message(s), HasSubstr("tile 7: section SLOT: expected ascending slots below 8"));
  s = test::small_first_pass();
  s.energy[3] = -1;
  EXPECT_THAT(message(s), HasSubstr("section ENRG"));
  s = test::small_first_pass();
  s.site[0] = 16;
  EXPECT_THAT(message(s), HasSubstr("section SITE"));
  s = test::small_first_pass();
  s.num_populations = 3;
  EXPECT_THAT(message(s), HasSubstr("section META"));
}

TEST(FirstPassSamples, KeepsWhatAMaskMayHold) {
  FirstPassSamples s = test::small_first_pass();
  s.keep_possible(0);
  EXPECT_EQ(std::accumulate(s.count.begin(), s.count.end(), 0), 2);
  EXPECT_EQ(s.count[6], 2);
  EXPECT_EQ(s.energy, (std::vector<float>{12.5f, 13.5f}));

  // Radius 1: the 3 x 3 around (1, 1), and the border.
  s = test::small_first_pass();
  s.keep_possible(1);
  for (std::size_t pixel = 0; pixel < 20; ++pixel) {
    const std::size_t x = pixel % 5;
    const std::size_t y = pixel / 5;
    const bool border = x == 0 || y == 0 || x == 4 || y == 3;
    EXPECT_EQ(s.count[pixel], border || x <= 2 ? 2 : 0) << x << "," << y;
  }
}

}  // namespace
}  // namespace baton
