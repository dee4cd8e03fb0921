// SPDX-License-Identifier: Apache-2.0
// The record of a run: what it keeps of a repetition, and of tasks.
#include "results/run_record.hpp"

#include <gmock/gmock.h>

#include "hotpath/reference_system/yaml_file.hpp"
#include "results/summary.hpp"

namespace hotpath::run_record_test {

using namespace std::chrono_literals;
using testing::HasSubstr;
using testing::Pair;
using testing::UnorderedElementsAre;

TaskSet timer_and_subscription() {
  TaskSet set;
  set.groups = {CallbackGroup::mutually_exclusive, CallbackGroup::reentrant};
  set.tasks.resize(2);
  set.tasks[0].name = "Lidar";
  set.tasks[0].period = set.tasks[0].deadline = 100ms;
  set.tasks[0].phase = 3ms;
  set.tasks[1].name = "Filter/points";
  set.tasks[1].kind = TaskKind::subscription;
  set.tasks[1].group = 1;
  return set;
}

TEST(RunRecord, KeepsTheLossesOfARepetition) {
  results::Repetition repetition;
  repetition.trace.executor = "rm-ro";
  repetition.trace.repetition = 4;
  repetition.trace.lost_records = 17;
  repetition.trace.chains.resize(3);
  for (std::uint32_t i = 0; i < 3; ++i) repetition.trace.chains[i].dropped = i + 1;
  repetition.trace.chains[2].chain = 1;
  const results::RepetitionRecord record =
      results::record_of(timer_and_subscription(), {"hot_path", "other", "silent"}, repetition);
  EXPECT_EQ(record.repetition, 4U);
  EXPECT_EQ(record.lost_records, 17U);
  EXPECT_THAT(record.hot_path_drops,
              UnorderedElementsAre(Pair("hot_path", 3), Pair("other", 3), Pair("silent", 0)));
  EXPECT_THAT(record.first_timestamps, UnorderedElementsAre(Pair("Lidar", 3ms)));
}

/// Gives the members of a record values that they do not have by default.
class Filler {
 public:
  void operator()(const char*, auto&& value) {
    if constexpr (std::is_lvalue_reference_v<decltype(value)>) fill(value);  // not computed
  }
  template <class T>
  void unless(const std::type_identity_t<T>&, const char*, T& value) {
    fill(value);
  }
  void if_any(const char*, auto& value) { fill(value.emplace()); }
  void up_to(auto, const char*, auto& value) { fill(value); }
  void ms(const char*, auto& value, double = 0) { fill(value); }
  void ns(const char*, Duration& value) { fill(value); }

 private:
  template <class T>
  void fill(T& value) {
    if constexpr (program::JsonRecord<T>)
      fields(*this, value);
    else if constexpr (EnumWithTexts<T>)
      value = enum_texts(T{}).back().value;
    else if constexpr (std::is_arithmetic_v<T>)
      value = static_cast<T>(2);
    else if constexpr (std::is_same_v<T, Duration>)
      value = 2ms;
    else if constexpr (std::is_same_v<T, std::string>)
      value = "two";
    else if constexpr (requires { value["task"]; })
      fill(value["task"]);
    else if constexpr (requires { value.emplace_back(); })
      fill(value.emplace_back());
    else if constexpr (requires { value.value(); })
      fill(value.emplace());
  }
};

/// Expects the keys in docs/results.md, except for those of a machine, and of a platform, which are a
/// graph's.
void expect_documented(const nlohmann::json& stored) {
  static const std::string docs = read_text_file(HOTPATH_RESULTS_PAGE);
  if (!stored.is_structured()) return;
  for (const auto& [key, value] : stored.items()) {
    EXPECT_TRUE(stored.is_array() || docs.find("`" + key + "`") != docs.npos) << key;
    if (key != "machine" && key != "platform") expect_documented(value);
  }
}

/// A new key needs no other test.
TEST(RunRecord, EachKeyIsReadAsItWasWrittenAndDocumented) {
  for (const bool live : {false, true}) {
    results::RunRecord record;
    Filler fill;
    visit_fields(fill, record);
    live ? visit_fields(fill, record.live.emplace()) : visit_fields(fill, record.simulation.emplace());
    record.tasks = timer_and_subscription();
    const nlohmann::json stored = record;
    EXPECT_EQ(nlohmann::json(stored.get<results::RunRecord>()), stored);
    expect_documented(stored);
  }
}

TEST(Summary, EachKeyIsDocumented) {
  expect_documented(results::summarize(timer_and_subscription(), {{"default", {{}}}}, {{"chain"}, {}, {}}));
}

TEST(RunRecord, ATimerWithoutAPeriodAndATaskOfNoKindAreRejected) {
  results::RunRecord record;
  record.simulation.emplace();
  record.tasks = timer_and_subscription();
  const nlohmann::json good = record;
  for (const auto& [change, says] : {std::pair(R"({"period_ns": 0})", "`period_ns` of Lidar is 0"),
                                     std::pair(R"({"kind": "waitable"})", "`kind` is `waitable`")}) {
    nlohmann::json stored = good;
    stored["tasks"][0].update(nlohmann::json::parse(change));
    EXPECT_THAT([&] { stored.get<results::RunRecord>(); },
                testing::ThrowsMessage<std::out_of_range>(HasSubstr(says)));
  }
}

}  // namespace hotpath::run_record_test
