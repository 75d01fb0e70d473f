#include "jobs/study/svg_chart.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

#include "jobs/study/chart_axis.h"
#include "jobs/study/svg_text.h"

namespace baton {
namespace {

constexpr double kWidth = 620, kHeight = 400;
constexpr double kLeft = 66, kRight = 452, kTop = 34, kBottom = 348;
constexpr double kLegendLeft = 468, kLegendStep = 19;
constexpr double kMarker = 3.6;
constexpr const char* kAxisColour = "#555";

/// Okabe & Ito's colours, told apart with any colour vision; yellow darkened for white paper.
constexpr std::array<const char*, 8> kPalette{"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                              "#e69f00", "#56b4e9", "#000000", "#8c7a00"};

class Drawing {
 public:
  explicit Drawing(const Chart& chart)
      : chart_(chart),
        x_(values(chart, true), chart.x_scale, kLeft, kRight),
        y_(values(chart, false), chart.y_scale, kBottom, kTop) {}

  std::string draw() {
    add(R"(<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {} {}" width="{}" height="{}" )"
        R"(font-family="Helvetica, Arial, sans-serif" font-size="11">)"
        "\n",
        kWidth, kHeight, kWidth, kHeight);
    add(R"(<rect width="{}" height="{}" fill="#fff"/>)"
        "\n",
        kWidth, kHeight);
    add(R"(<text x="{}" y="18" font-size="13" font-weight="bold">{}</text>)"
        "\n",
        kLeft, escaped(chart_.title));
    draw_axes();
    draw_floor();
    for (const ChartSeries& series : chart_.series) draw_band(series);
    for (const ChartSeries& series : chart_.series) draw_series(series);
    draw_legend();
    add("</svg>\n");
    return std::move(text_);
  }

 private:
  template <class... A>
  void add(fmt::format_string<A...> format, A&&... arguments) {
    fmt::format_to(std::back_inserter(text_), format, std::forward<A>(arguments)...);
  }

  /// Every x, or every y, that must be on the axis.
  static std::vector<double> values(const Chart& chart, bool x) {
    std::vector<double> result;
    const bool log_x = chart.x_scale == AxisScale::log, log_y = chart.y_scale == AxisScale::log;
    for (const ChartSeries& series : chart.series) {
      for (const ChartPoint& point : series.points) {
        if ((log_x && !(point.x > 0)) || (log_y && !(point.y > 0))) continue;
        result.push_back(x ? point.x : point.y);
        // A band that reaches far down on a log scale must not flatten the rest.
        if (!x) result.push_back(log_y ? std::max(point.low, point.y / 4) : point.low);
        if (!x) result.push_back(point.high);
      }
    }
    return result;
  }

  bool shows(const ChartPoint& point) const {
    return std::isfinite(point.x) && std::isfinite(point.y) && x_.shows(point.x) &&
           y_.shows(point.y);
  }
  double y_at(double value) const {
    return y_.shows(value) ? std::clamp(y_.position(value), kTop, kBottom) : kBottom;
  }

  void draw_axes() {
    for (const ChartAxis::Tick& tick : x_.ticks()) {
      const double at = x_.position(tick.value);
      add(R"(<path d="M{:.1f} {}V{}" stroke="{}"/>)", at, kTop, kBottom,
          tick.label.empty() ? "#f2f2f2" : "#e0e0e0");
      add(R"(<text x="{:.1f}" y="{}" text-anchor="middle" fill="{}">{}</text>)"
          "\n",
          at, kBottom + 16, kAxisColour, tick.label);
    }
    for (const ChartAxis::Tick& tick : y_.ticks()) {
      const double at = y_.position(tick.value);
      add(R"(<path d="M{} {:.1f}H{}" stroke="{}"/>)", kLeft, at, kRight,
          tick.label.empty() ? "#f2f2f2" : "#e0e0e0");
      add(R"(<text x="{}" y="{:.1f}" text-anchor="end" fill="{}">{}</text>)"
          "\n",
          kLeft - 6, at + 4, kAxisColour, tick.label);
    }
    add(R"(<path d="M{} {}V{}H{}" fill="none" stroke="{}"/>)"
        "\n",
        kLeft, kTop, kBottom, kRight, kAxisColour);
    add(R"(<text x="{}" y="{}" text-anchor="middle">{}</text>)"
        "\n",
        0.5 * (kLeft + kRight), kBottom + 36, escaped(chart_.x_label));
    add(R"~(<text transform="translate(15 {}) rotate(-90)" text-anchor="middle">{}</text>)~"
        "\n",
        0.5 * (kTop + kBottom), escaped(chart_.y_label));
  }

  void draw_floor() {
    if (!chart_.floor || !y_.shows(*chart_.floor)) return;
    const double at = y_.position(*chart_.floor);
    if (at > kBottom || at < kTop) return;
    add(R"(<path d="M{} {:.1f}H{}" stroke="#999" stroke-dasharray="2 3"/>)"
        R"(<text x="{}" y="{:.1f}" text-anchor="end" fill="#777" font-size="9">)"
        "reference's own error</text>\n",
        kLeft, at, kRight, kRight - 4, at - 3);
  }

  void draw_band(const ChartSeries& series) {
    std::string forth, back;
    for (const ChartPoint& point : series.points) {
      if (!shows(point)) continue;
      forth += fmt::format("{:.1f},{:.1f} ", x_.position(point.x), y_at(point.high));
      back = fmt::format("{:.1f},{:.1f} ", x_.position(point.x), y_at(point.low)) + back;
    }
    if (forth.empty()) return;
    add(R"(<polygon points="{}{}" fill="{}" fill-opacity="0.16"/>)"
        "\n",
        forth, back, series_colour(series.colour));
  }

  /// Where the palette repeats, lines are dashed and markers squares.
  static bool repeats(const ChartSeries& series) {
    return static_cast<std::size_t>(series.colour) >= kPalette.size();
  }
  static const char* dash_of(const ChartSeries& series) {
    return repeats(series) ? R"( stroke-dasharray="5 3")" : "";
  }
  void draw_marker(const ChartSeries& series, double x, double y, const char* fill,
                   const std::string& title) {
    const char* const colour = series_colour(series.colour);
    if (repeats(series)) {
      add(R"(<rect x="{:.1f}" y="{:.1f}" width="{}" height="{}" fill="{}" stroke="{}">{}</rect>)",
          x - kMarker, y - kMarker, 2 * kMarker, 2 * kMarker, fill, colour, title);
    } else {
      add(R"(<circle cx="{:.1f}" cy="{:.1f}" r="{}" fill="{}" stroke="{}">{}</circle>)", x, y,
          kMarker, fill, colour, title);
    }
  }

  void draw_series(const ChartSeries& series) {
    const char* const colour = series_colour(series.colour);
    std::string path;
    for (const ChartPoint& point : series.points) {
      if (!shows(point)) continue;
      path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L", x_.position(point.x),
                          y_.position(point.y));
    }
    if (path.empty()) return;
    add(R"(<path d="{}" fill="none" stroke="{}" stroke-width="1.6"{}/>)"
        "\n",
        path, colour, dash_of(series));
    for (const ChartPoint& point : series.points) {
      if (!shows(point)) continue;
      const double x = x_.position(point.x), y = y_.position(point.y);
      draw_marker(series, x, y, point.hollow ? "#fff" : colour,
                  fmt::format("<title>{}: {}, {:.4g}, {:.4g} [{:.4g}, {:.4g}]</title>",
                              escaped(series.name), escaped(point.label), point.x, point.y,
                              point.low, point.high));
      if (point.marked) {
        add(R"(<circle cx="{:.1f}" cy="{:.1f}" r="{}" fill="none" stroke="#000"/>)"
            R"(<text x="{:.1f}" y="{:.1f}" font-size="9" fill="#333">{}</text>)",
            x, y, kMarker + 3, x + 8, y - 6, escaped(point.label));
      }
      add("\n");
    }
  }

  void draw_legend() {
    double y = kTop + 8;
    bool marked = false, hollow = false;
    for (const ChartSeries& series : chart_.series) {
      const char* const colour = series_colour(series.colour);
      add(R"(<path d="M{} {}h18" stroke="{}" stroke-width="2"{}/>)", kLegendLeft, y, colour,
          dash_of(series));
      draw_marker(series, kLegendLeft + 9, y, colour, "");
      add(R"(<text x="{}" y="{}">{}</text>)"
          "\n",
          kLegendLeft + 24, y + 4, escaped(series.name));
      y += kLegendStep;
      for (const ChartPoint& point : series.points) {
        marked = marked || point.marked;
        hollow = hollow || point.hollow;
      }
    }
    const auto note = [&](const char* fill, double radius, const char* stroke, const char* text) {
      add(R"(<circle cx="{}" cy="{}" r="{}" fill="{}" stroke="{}"/>)"
          R"(<text x="{}" y="{}" fill="#555" font-size="10">{}</text>)"
          "\n",
          kLegendLeft + 9, y, radius, fill, stroke, kLegendLeft + 24, y + 4, text);
      y += kLegendStep;
    };
    y += 6;
    if (marked) note("none", kMarker + 3, "#000", "Pareto front");
    if (hollow) note("#fff", kMarker, "#555", "not resolved");
  }

  const Chart& chart_;
  ChartAxis x_, y_;
  std::string text_;
};

}  // namespace

std::string svg_chart(const Chart& chart) { return Drawing(chart).draw(); }

const char* series_colour(int colour) {
  return kPalette[static_cast<std::size_t>(colour) % kPalette.size()];
}

}  // namespace baton
