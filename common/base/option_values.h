#pragma once

#include <cmath>
#include <cstdlib>
#include <string>

namespace baton {

/// What is wrong with the values of a program's options, given for one of CLI11: no option takes
/// nothing at all where a value belongs, nor a number that is none or has no end, which every range
/// lets pass. Empty: nothing is. App: CLI::App, once all is read and before any command runs.
template <class App>
std::string value_fault(const App& app) {
  for (const auto* const option : app.get_options()) {
    const bool is_number = option->get_type_name().starts_with("FLOAT");
    const bool takes_value = option->get_items_expected_max() > 0;
    for (const std::string& value : option->results()) {
      const bool is_endless = is_number && !std::isfinite(std::strtod(value.c_str(), nullptr));
      if ((takes_value && value.empty()) || is_endless)
        return option->get_name() + ": expected " + option->get_description() + "; got '" + value +
               "'";
    }
  }
  for (const auto* const command : app.get_subcommands()) {
    if (std::string fault = value_fault(*command); !fault.empty()) return fault;
  }
  return {};
}

}  // namespace baton
