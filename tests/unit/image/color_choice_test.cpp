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
  } cases[] = {
      {{"R", "G", "B"}, {"R", "G", "B"}, ""},
      {{"A", "B", "G", "R", "Z"}, {"R", "G", "B"}, "A"},
      {{"a", "b", "g", "r"}, {"r", "g", "b"}, "a"},
      {{"Red", "Green", "Blue", "Alpha"}, {"Red", "Green", "Blue"}, "Alpha"},
      {{"Beauty.B", "Beauty.G", "Beauty.R"}, {"Beauty.R", "Beauty.G", "Beauty.B"}, ""},
      {{"A", "Y"}, {"Y"}, "A"},
      {{"BY", "RY", "Y"}, {"Y", "RY", "BY"}, ""},
      {{"beauty_B", "beauty_G", "beauty_R", "z"}, {"beauty_R", "beauty_G", "beauty_B"}, ""},
      {{"c:a", "c:b", "c:g", "c:r"}, {"c:r", "c:g", "c:b"}, "c:a"},
      {{"my_blue", "my_green", "my_red"}, {"my_red", "my_green", "my_blue"}, ""},
      {{"mainB", "mainG", "mainR"}, {"mainR", "mainG", "mainB"}, ""},
      {{"dirBlue", "dirGreen", "dirRed"}, {"dirRed", "dirGreen", "dirBlue"}, ""},
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
  // Names that end as those of colours do, by chance.
  EXPECT_FALSE(choose_colors({{"", {"mask_R", "mask_G", "Z"}}}));
  EXPECT_FALSE(choose_colors({{"", {"area", "sun_a", "motion_y"}}}));
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
  // The name of a part counts as that of a layer does, and the whole name before a part of it.
  const Channels other{"albedo.R", "albedo.G", "albedo.B", "R", "G", "B"};
  const auto part_of = [](const std::vector<PartLayout>& parts) { return chosen(parts).part; };
  EXPECT_EQ(part_of({{"albedo", rgb}, {"beauty", rgb}}), 1u);
  EXPECT_EQ(part_of({{"albedo", rgb}, {"Combined", other}}), 1u);
  EXPECT_EQ(chosen({{"albedo", rgb}, {"Combined", other}}).colors, rgb);
  EXPECT_EQ(part_of({{"beauty_diffuse", rgb}, {"specular", rgb}, {"beauty", diffuse}}), 2u);
  EXPECT_EQ(part_of({{"N", {"R", "G", "B"}}, {"rgba.left", rgb}, {"rgba.right", rgb}}), 1u);
  EXPECT_EQ(part_of({{"beauty", {"Y"}}, {"albedo", rgb}}), 1u);
  EXPECT_THAT(chosen({{"albedo", rgb}, {"beauty", rgb}}).notes,
              ElementsAre(HasSubstr("part 2 \"beauty\"")));
  EXPECT_THAT(chosen({{"", {"a_R", "a_G", "a_B", "b_R", "b_G", "b_B"}}}).notes,
              ElementsAre(HasSubstr("layer \"a\"")));
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
