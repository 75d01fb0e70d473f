#include "common/image/color_choice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace baton {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using Channels = std::vector<std::string>;

ColorChoice chosen(const std::vector<PartLayout>& parts) {
  const auto choice = choose_colors(parts);
  EXPECT_TRUE(choice);
  return choice.value_or(ColorChoice{});
}

TEST(ColorChoice, KnowsColoursByTheirNames) {
  const struct {
    Channels channels, colors;
    std::string alpha;
  } cases[] = {{{"R", "G", "B"}, {"R", "G", "B"}, ""},
               {{"A", "B", "G", "R", "Z"}, {"R", "G", "B"}, "A"},
               {{"a", "b", "g", "r"}, {"r", "g", "b"}, "a"},
               {{"Red", "Green", "Blue", "Alpha"}, {"Red", "Green", "Blue"}, "Alpha"},
               {{"Beauty.B", "Beauty.G", "Beauty.R"}, {"Beauty.R", "Beauty.G", "Beauty.B"}, ""},
               {{"A", "Y"}, {"Y"}, "A"},
               {{"BY", "RY", "Y"}, {"Y", "RY", "BY"}, ""},
               {{"left.RY", "left.BY", "left.Y"}, {"left.Y", "left.RY", "left.BY"}, ""},
               {{"R"}, {"R"}, ""},
               {{"anything"}, {"anything"}, ""}};
  for (const auto& c : cases) {
    const ColorChoice choice = chosen({{"", c.channels}});
    EXPECT_EQ(choice.colors, c.colors);
    EXPECT_EQ(choice.alpha, c.alpha);
    EXPECT_EQ(choice.notes.empty(), c.channels[0] != "anything");
  }
}

TEST(ColorChoice, WithoutColoursThereIsNoChoice) {
  EXPECT_FALSE(choose_colors({{"", {"N.X", "N.Y", "N.Z"}}}));
  EXPECT_FALSE(choose_colors({{"", {"N.X", "N.Y"}}}));
  EXPECT_FALSE(choose_colors({{"", {"U", "V"}}}));
  EXPECT_FALSE(choose_colors({{"a", {"Z"}}, {"b", {"id"}}}));
  EXPECT_EQ(any_channels({{"", {"N.X", "N.Y", "N.Z", "A"}}}).colors,
            (Channels{"N.X", "N.Y", "N.Z"}));
}

TEST(ColorChoice, PassesBesideAPictureAreNoChoice) {
  const ColorChoice plain =
      chosen({{"", {"albedo.R", "albedo.G", "albedo.B", "R", "G", "B", "A"}}});
  EXPECT_EQ(plain.colors, (Channels{"R", "G", "B"}));
  EXPECT_THAT(plain.notes, IsEmpty());
}

TEST(ColorChoice, OfSeveralPicturesOneIsReadAndSaid) {
  const Channels rgb{"R", "G", "B"}, diffuse{"diffuse.R", "diffuse.G", "diffuse.B"};
  // Depth first: no choice, as it has no colours.
  const ColorChoice depth = chosen({{"depth", {"Z"}}, {"rgb", rgb}});
  EXPECT_EQ(depth.part, 1u);
  EXPECT_THAT(depth.notes, IsEmpty());
  const ColorChoice stereo = chosen({{"left", rgb}, {"right", rgb}});
  EXPECT_EQ(stereo.part, 0u);
  EXPECT_THAT(stereo.notes, ElementsAre(HasSubstr("2 pictures: the colours of part 1 \"left\"")));
  const ColorChoice plain = chosen({{"diffuse", diffuse}, {"rgba", rgb}});
  EXPECT_EQ(plain.part, 1u);
  EXPECT_THAT(plain.notes, ElementsAre(HasSubstr("part 2 \"rgba\"")));
  const ColorChoice beauty =
      chosen({{"", {"diffuse.R", "diffuse.G", "diffuse.B", "Beauty.R", "Beauty.G", "Beauty.B"}}});
  EXPECT_EQ(beauty.colors[0], "Beauty.R");
  EXPECT_THAT(beauty.notes, ElementsAre(HasSubstr("layer \"Beauty\"")));
  // Three colours before one, whatever their names.
  EXPECT_EQ(chosen({{"", {"Y", "a.R", "a.G", "a.B"}}}).colors[0], "a.R");
}

TEST(ColorChoice, AColourThatIsMissingIsSaid) {
  const ColorChoice choice = chosen({{"", {"B", "G"}}});
  EXPECT_EQ(choice.colors, (Channels{"", "G", "B"}));
  EXPECT_THAT(choice.notes, ElementsAre(HasSubstr("lacks some")));
}

}  // namespace
}  // namespace baton
