// SPDX-License-Identifier: Apache-2.0
#include "hotpath/reference_system/yaml_file.hpp"

#include <yaml-cpp/eventhandler.h>

#include <cstdlib>
#include <memory>
#include <sstream>

#include "hotpath/core/input_file.hpp"
#include "hotpath/core/suggestion.hpp"

namespace hotpath {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kMaxFileBytes = std::size_t{4} << 20;

struct IgnoreEvents final : YAML::EventHandler {
  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t, const std::string&) override {}
  void OnSequenceStart(const YAML::Mark&, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {}
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark&, const std::string&, YAML::anchor_t, YAML::EmitterStyle::value) override {
  }
  void OnMapEnd() override {}
};

/// Whether a document follows the first one. YAML::LoadAll() would return empty documents endlessly
/// for a text that is not YAML and begins with a comma.
bool has_second_document(const std::string& text) {
  std::istringstream in(text);
  YAML::Parser parser(in);
  IgnoreEvents events;
  return parser.HandleNextDocument(events) && parser.HandleNextDocument(events);
}

}  // namespace

std::map<std::string, fs::path> yaml_files(const char* variable, const std::string& built_in) {
  const char* const given = std::getenv(variable);
  std::istringstream folders((given != nullptr ? std::string(given) + ":" : "") + built_in);
  std::map<std::string, fs::path> files;
  for (std::string folder; std::getline(folders, folder, ':');) {
    std::error_code error, ignored;
    for (fs::directory_iterator it(folder, error), end; !error && it != end; it.increment(error)) {
      const fs::path& path = it->path();
      if (path.extension() == ".yaml" && !it->is_directory(ignored)) files.emplace(path.stem(), path);
    }
  }
  return files;
}

bool is_yaml_path(const std::string& name_or_path) {
  const fs::path path(name_or_path);
  return name_or_path.find('/') != std::string::npos || path.extension() == ".yaml" ||
         path.extension() == ".yml";
}

std::string find_yaml(const std::string& kind, const std::map<std::string, fs::path>& files,
                      const std::string& name, std::vector<std::string> others) {
  if (const auto entry = files.find(name); entry != files.end()) return entry->second;
  for (const auto& [other, file] : files) others.push_back(other);
  throw InputError(name, 0, "there is no " + kind + " of this name",
                   suggest(name, others) + " (to give a file, include its extension .yaml)");
}

std::string read_text_file(const std::string& path) {
  const std::string remedy = "give the path of a readable YAML file";
  std::ifstream in = open_input(path, remedy);
  const auto text = std::make_unique_for_overwrite<char[]>(kMaxFileBytes + 1);
  in.read(text.get(), kMaxFileBytes + 1);
  const auto bytes = static_cast<std::size_t>(in.gcount());
  if (bytes > kMaxFileBytes) {
    throw InputError(path, 0, "the file has more than 4 MiB, the limit for this kind of file", remedy);
  }
  if (in.bad()) refuse_input(path, "input/output error", remedy);
  return {text.get(), bytes};
}

YAML::Node read_yaml(const std::string& file, const std::string& text, const std::string& remedy) {
  YAML::Node document;
  bool several = false;
  try {
    document = YAML::Load(text);
    several = has_second_document(text);
  } catch (const YAML::Exception& error) {
    const int line = error.mark.is_null() ? 0 : error.mark.line + 1;
    throw InputError(file, line, "not valid YAML: " + error.msg,
                     "correct indentation, colons and quotes here");
  }
  if (several) throw InputError(file, 0, "the file holds several YAML documents", remedy);
  if (document.IsNull()) throw InputError(file, 0, "the file is empty", remedy);
  if (!document.IsMap()) throw InputError(file, 1, "the file is not a map of keys", remedy);
  return document;
}

}  // namespace hotpath
