// SPDX-License-Identifier: Apache-2.0
#include <cstdio>
#include <exception>

#include "commands.hpp"
#include "hotpath/bench/errors.hpp"
#include "hotpath/bench/interrupt.hpp"
#include "hotpath/reference_system/graph_file.hpp"

namespace {

int report(const std::exception& error, int code) {
  std::fprintf(stderr, "hotpath: %s\n", error.what());
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "How long does data take along the hot path of a robot's node graph, under which executor?\n"
      "A first look:  hotpath compare --quick",
      "hotpath");
  app.set_version_flag("--version", HOTPATH_VERSION);
  app.require_subcommand(1);
  hotpath::add_run_command(app);
  hotpath::add_compare_command(app);
  hotpath::add_list_command(app);
  hotpath::add_graph_command(app);
  try {
    app.parse(argc, argv);
    return hotpath::interrupted() != 0 ? 128 + hotpath::interrupted() : 0;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  } catch (const hotpath::UsageError& error) {
    return report(error, 2);
  } catch (const hotpath::GraphError& error) {
    return report(error, 2);
  } catch (const std::exception& error) {
    return report(error, 1);
  }
}
