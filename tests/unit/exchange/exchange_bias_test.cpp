// Every form and mask of the second pass on every scene: the bias of each pixel with its standard
// error, printed as a table. What is unbiased by proof must show none, what is not must be seen.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "tests/unit/exchange/exact_scenes.h"

namespace baton {
namespace {

using namespace exact;
using exact::Method;
using exact::Scene;

struct Form {
  const char* name;
  Method method;
  int runs;
};

/// With 8 samples a mask of the same samples misses a pixel often enough to be seen.
const Form kForms[] = {
    {"corrected, cross-fold", {.num_slots = 8}, 40000},
    {"corrected, split", {.policy = MaskPolicy::split, .num_slots = 8}, 40000},
    {"corrected, same-samples", {.policy = MaskPolicy::same_samples, .num_slots = 8}, 40000},
    {"published", {.form = SecondPassForm::published, .num_slots = 8}, 10000},
    {"published-kept", {.form = SecondPassForm::published_kept, .num_slots = 8}, 10000},
};

/// Prints the bias of the mean over RGB of each pixel, in percent; its standard error is at most
/// the mean of the channels'. Returns the largest |z| of any pixel and channel.
double worst_z(const char* scene_name, const Scene& scene, const Form& form) {
  const Estimate e = estimate(scene, form.method, form.runs);
  const std::vector<double> expected = truth(scene);
  std::printf("| %s | %s |", scene_name, form.name);
  double worst = 0;
  for (std::size_t pixel = 0; pixel < scene.num_pixels(); ++pixel) {
    double bias = 0, error = 0, light = 0;
    for (std::size_t i = 3 * pixel; i < 3 * pixel + 3; ++i) {
      bias += e.mean[i] - expected[i];
      error += e.error[i];
      light += expected[i];
      // Floats add up to a relative 1e-5 at worst.
      worst = std::max(
          worst, std::fabs(e.mean[i] - expected[i]) / std::hypot(e.error[i], 1e-5 * expected[i]));
    }
    std::printf(" %+.2f (%.2f) |", 100 * bias / light, 100 * error / light);
  }
  std::printf("\n");
  return worst;
}

TEST(ExchangeBias, EveryFormByScene) {
  struct {
    const char* name;
    Scene scene;
    /// Then the published acceptance is the right one.
    bool equal_products;
    /// Enough to be seen: energy that stays in the wrong pixel is of another size.
    bool mask_matters;
  } const scenes[] = {{"equal products", penumbra(), true, false},
                      {"Lns 1 : 3 : .5 : 2", scaled_penumbra(), true, false},
                      {"diffuse and glossy", mixed_materials(), false, true},
                      {"nearly blocked, nearly free", extremes(), false, false}};
  for (const auto& s : scenes) {
    EXPECT_LT(worst_z(s.name, s.scene, kForms[0]), kLimit);
    EXPECT_LT(worst_z(s.name, s.scene, kForms[1]), kLimit);
    const double same_samples = worst_z(s.name, s.scene, kForms[2]);
    EXPECT_TRUE(same_samples > kLimit || !s.mask_matters) << same_samples;
    EXPECT_GT(worst_z(s.name, s.scene, kForms[3]), 10 * kLimit);
    const double kept = worst_z(s.name, s.scene, kForms[4]);
    EXPECT_EQ(kept > kLimit, !s.equal_products) << kept;
  }
}

}  // namespace
}  // namespace baton
