// SPDX-License-Identifier: Apache-2.0
#include "message.hpp"

#include <cstring>

#include "hotpath/campaign/campaign.hpp"

namespace hotpath {

namespace {

void append(std::string& bytes, std::uint64_t number) {
  bytes.append(reinterpret_cast<const char*>(&number), sizeof(number));
}

void append(std::string& bytes, const std::string& text) {
  append(bytes, text.size());
  bytes += text;
}

class Reader {
 public:
  explicit Reader(const std::string& bytes) : bytes_(bytes) {}

  std::uint64_t number() {
    std::uint64_t value = 0;
    std::memcpy(&value, take(sizeof(value)), sizeof(value));
    return value;
  }
  std::string text() {
    const std::uint64_t size = number();
    const char* const from = take(size);
    return {from, size};
  }

 private:
  const char* take(std::uint64_t size) {
    if (size > bytes_.size() - at_) {
      throw CampaignError("a rank sent an invalid message; run the same program on all ranks");
    }
    const char* const from = bytes_.data() + at_;
    at_ += size;
    return from;
  }

  const std::string& bytes_;
  std::size_t at_ = 0;
};

}  // namespace

std::string pack(const Message& message) {
  std::string bytes;
  append(bytes, static_cast<std::uint64_t>(message.kind));
  append(bytes, message.number);
  append(bytes, message.text);
  append(bytes, message.cells.size());
  for (const std::uint64_t cell : message.cells) append(bytes, cell);
  append(bytes, message.results.size());
  for (const CellResult& result : message.results) {
    append(bytes, result.cell);
    append(bytes, result.row);
    append(bytes, result.failure);
  }
  return bytes;
}

Message unpack(const std::string& bytes) {
  Reader reader(bytes);
  Message message;
  message.kind = static_cast<Message::Kind>(reader.number());
  message.number = reader.number();
  message.text = reader.text();
  for (std::uint64_t left = reader.number(); left > 0; --left) message.cells.push_back(reader.number());
  for (std::uint64_t left = reader.number(); left > 0; --left) {
    CellResult& result = message.results.emplace_back();
    result.cell = reader.number();
    result.row = reader.text();
    result.failure = reader.text();
  }
  return message;
}

}  // namespace hotpath
