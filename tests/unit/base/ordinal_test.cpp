#include "common/base/ordinal.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "common/base/archive.h"

namespace baton {
namespace {

using Apple = Ordinal<struct AppleTag>;
using Pear = Ordinal<struct PearTag>;

template <class A, class B>
concept Assigned = requires(A a, B b) {
  a = b;
};
template <class A, class B>
concept Added = requires(A a, B b) {
  a + b;
};
template <class A, class B>
concept Subtracted = requires(A a, B b) {
  a - b;
};
template <class A, class B>
concept Compared = requires(A a, B b) {
  a == b;
}
|| requires(A a, B b) { a < b; };
template <class A, class B>
concept Mixed = Assigned<A, B> || Added<A, B> || Subtracted<A, B> || Compared<A, B> ||
    std::is_convertible_v<A, B> || std::is_constructible_v<A, B>;

static_assert(!Mixed<Apple, Pear> && !Mixed<Pear, Apple>);
static_assert(!std::is_convertible_v<int, Apple> && !std::is_convertible_v<Apple, int>);
static_assert(!Assigned<Apple, int> && !Compared<Apple, int> && !Assigned<int, Apple>);
static_assert(!Added<Apple, Apple> && !Added<int, Apple> && !Subtracted<int, Apple>);
static_assert(Added<Apple, int> && Subtracted<Apple, int> && Compared<Apple, Apple>);
static_assert(std::is_same_v<decltype(Apple(3) - Apple(1)), std::int32_t>);
static_assert(sizeof(Apple) == sizeof(std::int32_t) && Apple().value() == 0);

TEST(Ordinal, CountsAndComparesLikeItsNumber) {
  Apple apple(7);
  EXPECT_EQ(++apple, Apple(8));
  EXPECT_EQ(--apple - 2, Apple(5));
  EXPECT_EQ(apple + 2 - Apple(4), 5);
  EXPECT_LT(Apple(-1), Apple(0));
  EXPECT_EQ(apple.index(), 7u);
  EXPECT_EQ(fmt::format("{} {:04}", apple, apple), "7 0007");
}

TEST(Ordinal, HasTheBytesOfItsNumber) {
  for (const std::int32_t number : {0, 1, -1, 0x01020304}) {
    const Bytes bytes = to_bytes(std::vector{Apple(number), Apple(5)});
    ASSERT_EQ(bytes, to_bytes(std::vector{number, 5}));
    std::vector<Apple> back;
    ArchiveReader reader(bytes);
    reader(back);
    EXPECT_TRUE(reader.complete());
    EXPECT_EQ(back, (std::vector{Apple(number), Apple(5)}));
  }
}

}  // namespace
}  // namespace baton
