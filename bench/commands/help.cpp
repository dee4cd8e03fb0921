// SPDX-License-Identifier: Apache-2.0
// The pages of --help and --help-all, and the man pages, which all come from the definitions of the options.
#include <algorithm>
#include <map>
#include <sstream>

#include "commands/command.hpp"

namespace hotpath::commands {

namespace {

std::map<const CLI::App*, std::vector<std::string>> first_options;  // by command

std::vector<const CLI::App*> visible_commands(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* command) { return !command->get_group().empty(); });
}

class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
    const bool whole = mode == CLI::AppFormatMode::All;
    const auto first = first_options.find(app);
    const bool some = !whole && first != first_options.end();
    std::string page = make_description(app) + make_usage(app, name);
    if (some) page += "\n" + chosen(*app, first->second);
    if (!some && (whole || app->get_parent() != nullptr))
      page += make_positionals(app) + make_groups(app, mode);
    page += make_subcommands(app, mode) + "\n" + make_footer(app);
    if (some) page += "All options:  " + name + " --help-all\n";
    return CLI::detail::find_and_replace(page, "\n\n\n", "\n\n");
  }

  /// A line each, with the name of their group, if it is short, in the first column.
  std::string make_subcommands(const CLI::App* app, CLI::AppFormatMode) const override {
    std::string lines, last;
    for (const CLI::App* command : visible_commands(*app)) {
      const std::string group = app->get_parent() == nullptr ? command->get_group() : "";
      const bool is_new = group != std::exchange(last, group), fits = group.size() < 11;
      if (lines.empty() || (is_new && !fits)) lines += "\n";
      if (is_new && !fits) lines += group + ":\n";
      lines += text("%-*s%-13s %s\n", group.empty() || !fits ? 2 : 12, is_new && fits ? group.c_str() : "",
                    command->get_display_name(true).c_str(), command->get_description().c_str());
    }
    return lines;
  }

 private:
  /// Positions, and options with these names.
  std::string chosen(const CLI::App& app, const std::vector<std::string>& names) const {
    std::ostringstream lines;
    for (const bool position : {true, false}) {
      for (const CLI::Option* option : app.get_options()) {
        if (option->get_positional() != position) continue;
        if (!position && std::ranges::count(names, option->get_name()) == 0) continue;
        std::string left = make_option_name(option, position) + make_option_opts(option);
        left.erase(std::min({left.find(" Excludes:"), left.find(" Needs:"), left.size()}));
        CLI::detail::format_help(lines, left, make_option_desc(option), column_width_);
      }
    }
    return lines.str();
  }
};

/// Text of a man page, with a line of its own for each line that begins with a word and a colon.
std::string roff(const std::string& text) {
  std::string escaped;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    line.erase(0, line.find_first_not_of(' '));
    if (!escaped.empty()) escaped += line.substr(0, line.find(' ')).ends_with(':') ? "\n.br\n" : "\n";
    if (line.starts_with('.') || line.starts_with('\'')) escaped += "\\&";
    for (const char c : line) escaped += c == '\\' ? "\\e" : c == '-' ? "\\-" : std::string{c};
  }
  return escaped;
}

class ManFormatter : public CLI::Formatter {
 public:
  std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
    std::string usage = make_usage(app, "");
    std::string page = ".TH " + page_name(name) + " 1 \"\" \"hotpath " HOTPATH_VERSION "\"\n.SH NAME\n" +
                       page_name(name) + " \\- " + roff(app->get_description()) + "\n.SH SYNOPSIS\n.B " +
                       name + "\n" + roff(usage.substr(usage.find(' ') + 1)) + make_positionals(app) +
                       make_groups(app, mode);
    const std::vector<const CLI::App*> commands = visible_commands(*app);
    if (!commands.empty()) page += "\n.SH COMMANDS";
    for (const CLI::App* command : commands)
      page += "\n.TP\n.BR " + page_name(name + " " + command->get_name()) + " (1)\n" +
              roff(command->get_description());
    const std::string footer = app->get_footer();
    if (!footer.empty())
      page += "\n.SH EXAMPLE\n.nf\n" + roff(footer.substr(footer.find("hotpath"))) + "\n.fi";
    return CLI::detail::find_and_replace(page + "\n.SH SEE ALSO\n.BR hotpath (1)\n", "\n\n", "\n");
  }

  std::string make_group(std::string group, bool position,
                         std::vector<const CLI::Option*> options) const override {
    std::string text = "\n.SH " + roff(group);
    for (const CLI::Option* option : options) text += make_option(option, position);
    return text;
  }

  std::string make_option(const CLI::Option* option, bool position) const override {
    return "\n.TP\n\\fB" + roff(make_option_name(option, position)) + "\\fR " +
           roff(make_option_opts(option)) + "\n" + roff(make_option_desc(option));
  }

  static std::string page_name(std::string command) {
    std::ranges::replace(command, ' ', '-');
    return command;
  }
};

void write_man_pages(const CLI::App& app, const std::string& name, const std::filesystem::path& folder) {
  program::write_whole_file(folder / (ManFormatter::page_name(name) + ".1"),
                            ManFormatter().make_help(&app, name, CLI::AppFormatMode::All));
  for (const CLI::App* command : visible_commands(app))
    write_man_pages(*command, name + " " + command->get_name(), folder);
}

const Command kMan("", 195, [](CLI::App& app) {
  auto [command, folder] =
      add_command<std::string>(app, "man", "Write the man pages", "", [&app](const std::string& of) {
        program::create_folder(of);
        write_man_pages(app, "hotpath", of);
      });
  add(command, "FOLDER", folder, "FOLDER", "Folder of the pages")->required();
});

}  // namespace

void show_first(const CLI::App& command, const std::vector<std::string>& options) {
  first_options[&command] = options;
}

std::shared_ptr<CLI::FormatterBase> help_formatter() { return std::make_shared<HelpFormatter>(); }

}  // namespace hotpath::commands
