#include "worker/run/local_render.h"

#include <memory>
#include <utility>

#include "common/job/motion.h"
#include "common/job/plan/sequence.h"
#include "worker/exchange/second_pass.h"
#include "worker/pass/render_context.h"

namespace baton {

std::vector<std::set<std::int32_t>> LocalRender::tiles_before(Step step,
                                                              std::set<std::int32_t> wanted) const {
  std::vector<std::set<std::int32_t>> needed(step.index());
  if (!carries_state(context_.job)) return needed;
  // They spread by whole tiles with each frame back.
  for (auto tiles = needed.rbegin(); tiles != needed.rend(); ++tiles) {
    for (const std::int32_t heir : wanted) {
      for (const std::int32_t near : context_.grid.tiles_near(heir, history_reach_px(context_.job)))
        tiles->insert(near);
    }
    wanted = *tiles;
  }
  return needed;
}

Result<RenderedTile> LocalRender::render(Step step, std::int32_t tile) const {
  std::vector<StatePtr> previous;
  if (step > Step(0) && carries_state(context_.job)) {
    for (const std::int32_t near : context_.grid.tiles_near(tile, history_reach_px(context_.job)))
      previous.push_back(tiles_.at(near).state);
  }
  RenderedTile rendered;
  const TileRunSink sink{
      .film =
          [&](Step, const FilmTile& film) {
            rendered.film = film;
            return Status();
          },
      .state =
          [&](SampleState state) {
            rendered.state = std::make_shared<const SampleState>(std::move(state));
            return Status();
          },
      .samples =
          [&](FirstPassSamples samples) {
            rendered.samples = std::make_shared<const FirstPassSamples>(std::move(samples));
            return Status();
          }};
  // A run has its number for the farm alone.
  const TileRun run{tile, {}, {step, step}};
  BATON_ASSIGN(rendered.stats, run_tile(context_, run, previous, sink, {}));
  return rendered;
}

Status LocalRender::render_all(Step step, const std::set<std::int32_t>& tiles) {
  std::map<std::int32_t, RenderedTile> rendered;
  for (const std::int32_t tile : tiles) {
    BATON_ASSIGN(rendered[tile], render(step, tile));
  }
  keep(std::move(rendered));
  return {};
}

Result<RenderedTile> LocalRender::finished(Step step, std::int32_t tile) const {
  RenderedTile result = tiles_.at(tile);
  const VisibilitySpec& visibility = context_.job.visibility;
  if (!visibility.correlated) return result;
  std::vector<FirstPassPtr> near;
  for (const std::int32_t t : context_.grid.tiles_near(tile, exchange_reach_px(visibility)))
    near.push_back(tiles_.at(t).samples);
  BATON_ASSIGN(SecondPassOutput second, run_second_pass(context_, step, tile, result.film, near));
  result.film = std::move(second.film);
  result.stats.merge(second.stats);
  return result;
}

}  // namespace baton
