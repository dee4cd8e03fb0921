// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "commands/command.hpp"
#include "hotpath/core/utf8.hpp"

namespace hotpath::commands {

namespace {

/// With the name that `word` begins, or else the nearest one.
std::string text_of(const char* kind, const std::string& word, const std::vector<std::string>& names) {
  const auto begun = std::ranges::find_if(
      names, [&](const std::string& name) { return word.size() > 2 && name.starts_with(word); });
  return concat("unknown ", kind, " `", word, "`", did_you_mean(begun == names.end() ? word : *begun, names));
}

/// What is wrong with a command line that was refused because of a word that `command`, written as `path`,
/// does not know, and what to write instead; empty: another error.
std::string unknown_word(const CLI::App& app, const CLI::App& command, const std::string& path) {
  const std::vector<std::string> words = app.remaining(true);
  const bool wants_command = command.get_require_subcommand_min() > 0;
  const auto option =
      std::ranges::find_if(words, [](const std::string& word) { return word.starts_with("--"); });
  if (!wants_command && option == words.end()) return "";
  std::vector<std::string> names;
  for (const CLI::App* sub : command.get_subcommands({})) {
    if (!sub->get_group().empty()) names.push_back(sub->get_name());
  }
  if (wants_command && words.empty()) return "a command is missing; available: " + joined(names);
  const std::string word = wants_command ? words.front() : option->substr(0, option->find('='));
  if (wants_command && names.size() == 1 && did_you_mean(word, names).empty())  // it is the only command's
    return concat("unknown command `", word, "`; write `", path, " ", names.front(), " ", word, "`");
  if (wants_command) return text_of("command", word, names);
  for (const CLI::Option* known : command.get_options()) {
    for (const std::string& name : known->get_lnames()) names.push_back("--" + name);
  }
  return text_of("option", word, names);
}

}  // namespace

std::string wrong_use(const CLI::App* app, const CLI::Error& error) {
  const CLI::App* command = app;
  std::string path = app->get_name();
  for (; !command->get_subcommands().empty(); path += " " + command->get_name())
    command = command->get_subcommands().front();
  std::string message = unknown_word(*app, *command, path);
  if (message.empty()) message = error.what();
  if (message.starts_with("--graph is required")) message = "GRAPH is missing";
  return "hotpath: " + printable(message, kLongestMessage) + "; see `" + path + " --help`\n";
}

}  // namespace hotpath::commands
