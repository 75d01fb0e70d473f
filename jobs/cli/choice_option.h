#pragma once

#include <CLI/CLI.hpp>
#include <algorithm>
#include <string>
#include <utility>
#include <vector>

namespace baton {

/// An option whose value is one of these words, of which help, errors and completion tell.
template <class E>
CLI::Option* add_choice_option(CLI::App& command, const std::string& name, E& value,
                               const std::vector<std::pair<std::string, E>>& choices,
                               const std::string& about) {
  std::vector<std::string> words;
  for (const auto& [word, means] : choices) words.push_back(word);
  return command
      .add_option_function<std::string>(
          name,
          [&value, choices](const std::string& said) {
            value =
                std::ranges::find(choices, said, [](const auto& one) { return one.first; })->second;
          },
          about)
      ->check(CLI::IsMember(words));
}

}  // namespace baton
