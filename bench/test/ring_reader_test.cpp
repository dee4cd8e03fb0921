// SPDX-License-Identifier: Apache-2.0
#include "watch/session.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <memory>
#include <random>

#include "watch/observer.hpp"

namespace hotpath::watch::ring_reader_test {

using sensor::EventKind;
using sensor::kCapacity;
using sensor::Record;
using tracing::Event;

constexpr tracing::Time kNow{std::chrono::seconds(10)};

/// Writes records like the sensor.
class RingReading : public testing::Test {
 protected:
  Record& add(EventKind kind, std::int64_t at_ns, std::uint8_t following = 0) {
    Record& record = ring->records[ring->head % kCapacity];
    record = {};
    record.at_ns = at_ns;
    record.kind = kind;
    record.texts = following;
    ++ring->head;
    return record;
  }
  void add_text(const std::string& part, std::uint16_t which) {
    Record& record = add(sensor::kText, 0);
    record.length = static_cast<std::uint8_t>(part.size());
    record.which = which;
    std::memcpy(record.text, part.data(), part.size());
  }
  std::vector<Event> read() {
    std::vector<Event> events;
    reader.read(kNow, texts, events);
    return events;
  }

  std::unique_ptr<sensor::Ring> ring = [] {
    auto made = std::make_unique<sensor::Ring>();
    made->process = 7;
    made->thread = 8;
    return made;
  }();
  Texts texts;
  RingReader reader{*ring};
};

TEST_F(RingReading, GivesEventsWithTheirTexts) {
  Record& node = add(EventKind::node_init, 5, 3);
  node.number[0] = 11;
  node.processor = 3;
  add_text("a node with a long name that needs two records: ", 0);
  add_text("this one", 0);
  add_text("/space", 1);
  add(EventKind::callback_end, 6);
  const std::vector<Event> events = read();
  ASSERT_EQ(events.size(), 2U);
  EXPECT_THAT(events[0], testing::FieldsAre(EventKind::node_init, 7U, 8U, 3,
                                            tracing::Time(tracing::Duration(5)), testing::_, testing::_));
  EXPECT_EQ(events[0].number[0], 11U);
  EXPECT_STREQ(events[0].text[0], "a node with a long name that needs two records: this one");
  EXPECT_STREQ(events[0].text[1], "/space");
  EXPECT_EQ(events[1].kind, EventKind::callback_end);
  EXPECT_STREQ(events[1].text[0], "");
  EXPECT_EQ(reader.damaged(), 0U);
  EXPECT_EQ(ring->tail, 5U);
  EXPECT_TRUE(read().empty());
}

TEST_F(RingReading, CountsDamageAndGoesOn) {
  add(sensor::kText, 1);                                   // without its tracepoint
  add(static_cast<EventKind>(sensor::kEvents.size()), 1);  // unknown
  add(EventKind::callback_start, -1);                      // before the clock began
  add(EventKind::callback_start, (kNow.time_since_epoch() + std::chrono::seconds(2)).count());  // the future
  add(EventKind::callback_start, 1, 1);  // its text is another tracepoint
  add(EventKind::callback_end, 2);
  add(EventKind::node_init, 3, 200);  // more texts than there are records
  EXPECT_THAT(read(), testing::ElementsAre(testing::Field(&Event::at, tracing::Time{tracing::Duration(2)})));
  EXPECT_EQ(reader.damaged(), 6U);
  ring->head += kCapacity + 1;
  EXPECT_TRUE(read().empty());
  EXPECT_EQ(reader.damaged(), 7U);
  add(EventKind::callback_end, 4);
  EXPECT_EQ(read().size(), 1U);
}

/// Of a chain from a timer to a subscription.
Contract small_contract() {
  Contract contract;
  contract.callbacks.resize(3);
  contract.callbacks[0].node = "n";
  contract.callbacks[0].publishes = {{"n", {}}};
  contract.callbacks[0].terms = {{Clause::budget, 1}, {Clause::publishes, 1}, {Clause::maximum_distance, 1}};
  contract.callbacks[1].node = contract.callbacks[1].topic = "n";
  contract.callbacks[1].terms = {{Clause::minimum_distance, 5, Origin::given, {7}}, {Clause::lost}};
  contract.callbacks[2] = contract.callbacks[1];
  contract.callbacks[2].service = true;
  contract.callbacks[2].terms.push_back({Clause::budget, 1});
  contract.chains = {{"chain", {0}, {1}, {{Clause::age, 5}, {Clause::hot_path, 5}}}};
  contract.threads = {{"threads", {0, 1, 2}, {}, {{Clause::serves}, {Clause::wait}}}};
  return contract;
}

TEST_F(RingReading, SurvivesAnyBytes) {
  std::mt19937_64 random(1);
  Observer observer(small_contract(), nullptr);
  std::uint64_t events = 0;
  for (int round = 0; round < 50; ++round) {
    for (Record& record : ring->records) {
      std::array<std::uint64_t, sizeof(Record) / 8> bytes{};
      for (std::uint64_t& eight : bytes) eight = random();
      std::memcpy(&record, bytes.data(), sizeof record);
      // Bytes that almost are records go deeper.
      const auto kind = random() % (sensor::kEvents.size() + 1);
      if (random() % 2 == 0)
        record.kind = kind < sensor::kEvents.size() ? static_cast<EventKind>(kind) : sensor::kText;
      if (random() % 2 == 0) record.at_ns = static_cast<std::int64_t>(random() % 1000);
      if (random() % 2 == 0) record.texts = static_cast<std::uint8_t>(random() % 4);
      if (random() % 2 == 0) record.length = static_cast<std::uint8_t>(random() % (sensor::kTextBytes + 2));
      if (random() % 2 == 0) record.which = static_cast<std::uint16_t>(random() % 3);
      // Few handles and one name connect entities with each other and with the contract.
      if (record.kind != sensor::kText && random() % 4 != 0)
        for (std::uint64_t& number : record.number) number = random() % 3;
      if (record.kind == sensor::kText && random() % 2 == 0) std::memcpy(record.text, "n", 2);
    }
    ring->head += random() % 4 == 0 ? random() : random() % kCapacity;
    for (const Event& event : read()) {
      ++events;
      observer.event(event);
      EXPECT_LT(static_cast<std::size_t>(event.kind), sensor::kEvents.size());
      EXPECT_LE(event.at, kNow + std::chrono::seconds(1));
      EXPECT_GE(event.processor, -1);
      EXPECT_LE(std::strlen(event.text[0]), 255 * sensor::kTextBytes);
    }
  }
  EXPECT_GT(events, 0U);
  EXPECT_GT(reader.damaged(), 0U);
  EXPECT_FALSE(observer.callbacks().empty());
  observer.observed_until(kNow, 1);
  EXPECT_EQ(observer.judge().json(false)["terms"].size(), 13U) << observer.judge().incident();
}

TEST(MappedRing, ReadsMemoryThatWasCutAsZeros) {
  const std::string name = "/hotpath_watch_test." + std::to_string(getpid());
  const int file = shm_open(name.c_str(), O_RDWR | O_CREAT | O_EXCL, 0600);
  ASSERT_GE(file, 0);
  ASSERT_EQ(ftruncate(file, sizeof(sensor::Ring)), 0);
  EXPECT_EQ(RingMemory::map(name), nullptr) << "not initialised yet";
  ASSERT_EQ(pwrite(file, &sensor::kMagic, sizeof sensor::kMagic, 0), 8);
  {
    const MappedRing mapped = RingMemory::map(name);
    ASSERT_NE(mapped, nullptr);
    mapped->head = 3;
    ASSERT_EQ(ftruncate(file, 0), 0);
    EXPECT_EQ(mapped->head, 0U);
    EXPECT_EQ(mapped->records[kCapacity - 1].at_ns, 0);
  }
  EXPECT_EQ(RingMemory::map(name), nullptr) << "too small";
  close(file);
  shm_unlink(name.c_str());
}

}  // namespace hotpath::watch::ring_reader_test
