#include <gtest/gtest.h>

#include "common/job/text/job_json.h"

namespace baton {
namespace {

std::string material_faults(const std::string& text) {
  const Result<JobSpec> job = parse_job(text, "job.json", "/");
  return job.ok() ? "" : job.error().message;
}

TEST(MaterialFields, ACoatIsWrittenOnlyWhereThereIsOne) {
  const auto job_of = [](const std::string& coat) {
    return R"({"name": "test", "environment": {"map": "sky.exr"}, "scene": {"materials":
        {"paint": {"type": "metallicRoughness")" +
           coat + "}}}}";
  };
  const JobSpec bare = parse_job(job_of(""), "job.json", "/").value();
  EXPECT_EQ(to_json(bare).find("clearcoat"), std::string::npos);
  const JobSpec job =
      parse_job(job_of(R"(, "clearcoat": 0.5, "clearcoatTexture": "a.png", "clearcoatRoughness":
          0.25, "clearcoatRoughnessTexture": {"file": "b.png", "uv": 1},
          "clearcoatNormalTexture": {"file": "n.png", "strength": 2})"),
                "job.json", "/")
          .value();
  const MaterialSpec& paint = job.scene.materials.at("paint");
  EXPECT_EQ(paint.clearcoat, 0.5f);
  EXPECT_EQ(paint.clearcoat_roughness, 0.25f);
  EXPECT_EQ(paint.clearcoat_texture->file, "/a.png");
  EXPECT_EQ(paint.clearcoat_roughness_texture->uv, 1);
  EXPECT_EQ(paint.clearcoat_normal_texture->strength, 2);
  EXPECT_EQ(textures_of(paint).size(), 3u);
  EXPECT_EQ(parse_job(to_json(job), "again", "/").value(), job);
  EXPECT_EQ(material_faults(job_of(R"(, "clearcoat": 2, "clearcoatRoughness": 0)")),
            "job.json: $.scene.materials.paint.clearcoat: expected a number in [0, 1], got 2\n"
            "job.json: $.scene.materials.paint.clearcoatRoughness: expected a number in [0.02, 1], "
            "got 0");
  EXPECT_EQ(material_faults(job_of(R"(, "clearcoatTexture": "a.png")")),
            "job.json: $.scene.materials.paint.clearcoatTexture: expected clearcoat beside it, "
            "whose factor it is, got none");
}

TEST(MaterialFields, TilesHaveTheirMarkInTheNameOfAnImage) {
  const auto job_of = [](const std::string& texture) {
    return R"({"name": "test", "environment": {"map": "sky.exr"}, "scene": {"materials":
        {"skin": {"type": "diffuse", "colorTexture": )" +
           texture + "}}}}";
  };
  const JobSpec job = parse_job(job_of(R"("skin.<UDIM>.exr")"), "job.json", "/").value();
  EXPECT_EQ(job.scene.materials.at("skin").color_texture->file, "/skin.<UDIM>.exr");
  EXPECT_EQ(asset_paths(job), std::vector<std::string>{"/sky.exr"}) << "no file of that name";
  for (const char* const file : {"a<UDIM>/b.png", "a<UDIM>.<UDIM>.png"})
    EXPECT_EQ(material_faults(job_of(std::string("\"") + file + '"')),
              std::string("job.json: $.scene.materials.skin.colorTexture.file: expected <UDIM> at "
                          "most once, in the name of an image, got \"/") +
                  file + '"');
  EXPECT_EQ(material_faults(job_of(R"({"file": "a.<UDIM>.png", "wrapV": "clamp"})")),
            "job.json: $.scene.materials.skin.colorTexture.wrapU: expected no wrapU and wrapV "
            "beside <UDIM>, whose tiles end at their edges, got clamp");
}

}  // namespace
}  // namespace baton
