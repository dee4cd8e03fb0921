// SPDX-License-Identifier: Apache-2.0
// One table, four writers.
#include "program/table.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace hotpath::table_test {

using nlohmann::json;

struct Row {
  std::string name;
  std::optional<double> share;
  std::uint64_t jobs = 0;
  bool holds = false;
};

program::Table table() {
  const std::vector<program::Column<Row>> columns = {{"name", &Row::name},
                                                     {"share", &Row::share, "%.3g"},
                                                     {"mean_ms", &Row::share, "%.2f"},
                                                     {"jobs", &Row::jobs},
                                                     {"holds", &Row::holds}};
  const std::vector<Row> rows = {{"a,\"b\"", 1.23456, 7, true}, {"<c>", std::nullopt, 0, false}, {"", 12, 1}};
  return program::table_of(columns, rows);
}

TEST(TypedTable, IsWrittenAsText) {
  EXPECT_EQ(program::concat(table()),
            "name   share  mean_ms  jobs  holds\n"
            "----------------------------------\n"
            "a,\"b\"   1.23     1.23     7      1\n"
            "<c>                       0      0\n"
            "          12    12.00     1      0\n");
}

TEST(TypedTable, HasColumnsOfJson) {
  const std::vector<json> rows = {{{"of", {{"ms", 1.26}}}, {"cpu", 3}}, {{"of", json()}, {"cpu", json()}}};
  EXPECT_EQ(program::concat(program::table_of<json>(
                {{"ms", "/of/ms", "%.1f"}, {"cpu", "/cpu"}, {"thread", "/thread"}}, rows, "of JSON")),
            "of JSON\n\nms   cpu  thread\n----------------\n1.3    3       -\n-              -\n");
}

TEST(TypedTable, IsWrittenAsCsvWithQuotes) {
  EXPECT_EQ(csv_of(table()),
            "name,share,mean_ms,jobs,holds\n\"a,\"\"b\"\"\",1.23,1.23,7,1\n<c>,,,0,0\n,12,12.00,1,0\n");
}

TEST(TypedTable, IsWrittenAsJsonWithTheSameDigits) {
  const json rows = json_of(table());
  EXPECT_EQ(rows[0],
            json({{"name", "a,\"b\""}, {"share", 1.23}, {"mean_ms", 1.23}, {"jobs", 7}, {"holds", 1}}));
  EXPECT_EQ(rows[1]["share"], json());
  EXPECT_EQ(rows[2]["name"], json()) << "an empty text is no value";
  EXPECT_EQ(rows[2].dump(), R"({"holds":0,"jobs":1,"mean_ms":12.0,"name":null,"share":12})");
  program::Table numbers("", {"a", "b", "c", "d", "e"});
  numbers.add_row({NAN, 1e9, "", json(""), json(true)});
  EXPECT_EQ(json_of(numbers)[0].dump(), R"({"a":"nan","b":1000000000.0,"c":null,"d":"","e":true})");
}

TEST(TypedTable, IsWrittenAsMarkdown) {
  EXPECT_EQ(markdown_of(table(), {1, 3}),
            "| name | share | mean_ms | jobs | holds |\n| --- | ---: | --- | ---: | --- |\n"
            "| a,\"b\" | 1.23 | 1.23 | 7 | 1 |\n| &lt;c> |  |  | 0 | 0 |\n|  | 12 | 12.00 | 1 | 0 |\n");
}

}  // namespace hotpath::table_test
