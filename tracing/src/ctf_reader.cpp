// SPDX-License-Identifier: Apache-2.0
#include <exception>
#include <iomanip>
#include <sstream>
#include <unordered_map>

#include "babeltrace.hpp"
#include "hotpath/tracing/ctf_trace.hpp"

namespace hotpath::tracing {

namespace {

namespace fs = std::filesystem;

OwnedValue inputs_of(const fs::path& folder) {
  OwnedValue params(bt_value_map_create());
  bt_value* inputs = nullptr;
  bt_value_map_insert_empty_array_entry(params.get(), "inputs", &inputs);
  bt_value_array_append_string_element(inputs, folder.c_str());
  return params;
}

std::uint64_t number_in(const bt_field* field) {
  if (field == nullptr) return 0;
  const bt_field_class_type type = bt_field_get_class_type(field);
  if (bt_field_class_type_is(type, BT_FIELD_CLASS_TYPE_UNSIGNED_INTEGER))
    return bt_field_integer_unsigned_get_value(field);
  if (bt_field_class_type_is(type, BT_FIELD_CLASS_TYPE_SIGNED_INTEGER))
    return static_cast<std::uint64_t>(bt_field_integer_signed_get_value(field));
  return 0;
}

const char* text_in(const bt_field* field) {
  if (field == nullptr || bt_field_get_class_type(field) != BT_FIELD_CLASS_TYPE_STRING) return "";
  return bt_field_string_get_value(field);
}

/// Eight bytes of an array from position `first` on, the first one highest; 0: there is no such array.
std::uint64_t bytes_in(const bt_field* field, std::uint64_t first) {
  if (field == nullptr) return 0;
  const bt_field_class_type type = bt_field_get_class_type(field);
  if (!bt_field_class_type_is(type, BT_FIELD_CLASS_TYPE_ARRAY) ||
      bt_field_array_get_length(field) < first + 8)
    return 0;
  std::uint64_t bytes = 0;
  for (std::uint64_t i = first; i < first + 8; ++i)
    bytes = bytes << 8 | (number_in(bt_field_array_borrow_element_field_by_index_const(field, i)) & 0xff);
  return bytes;
}

constexpr std::uint64_t kNoField = ~std::uint64_t{0};

/// The position of a member in a structure's class; kNoField: there is no such member.
std::uint64_t position(const bt_field_class* structure, std::string_view name) {
  if (structure == nullptr) return kNoField;
  const std::uint64_t count = bt_field_class_structure_get_member_count(structure);
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto* member = bt_field_class_structure_borrow_member_by_index_const(structure, i);
    if (name == bt_field_class_structure_member_get_name(member)) return i;
  }
  return kNoField;
}

const bt_field* member(const bt_field* structure, std::uint64_t at) {
  if (structure == nullptr || at == kNoField) return nullptr;
  return bt_field_structure_borrow_member_field_by_index_const(structure, at);
}

/// Where to find the fields of a class of events, filled in at its first event.
struct EventClass {
  std::uint64_t* count = nullptr;
  const EventFormat* format = nullptr;  ///< nullptr: only counted.
  std::vector<std::uint64_t> fields;    ///< Positions, parallel to those of the format.
  std::uint64_t process = kNoField, thread = kNoField, processor = kNoField;
};

class Reader {
 public:
  explicit Reader(const std::function<void(const Event&)>& visit) : visit_(visit) {}

  TraceReading read(const std::vector<fs::path>& folders) {
    const OwnedPlugin ctf = find_plugin("ctf"), utils = find_plugin("utils");
    const auto* const fs_class = bt_plugin_borrow_source_component_class_by_name_const(ctf.get(), "fs");
    const auto* const muxer_class =
        bt_plugin_borrow_filter_component_class_by_name_const(utils.get(), "muxer");
    const OwnedGraph graph(bt_graph_create(0));
    const bt_component_filter* muxer = nullptr;
    bt_graph_add_filter_component(graph.get(), muxer_class, "muxer", nullptr, BT_LOGGING_LEVEL_NONE, &muxer);
    std::uint64_t connected = 0;
    for (const fs::path& folder : folders) {
      const bt_component_source* source = nullptr;
      const OwnedValue params = inputs_of(folder);
      if (bt_graph_add_source_component(graph.get(), fs_class, folder.c_str(), params.get(),
                                        BT_LOGGING_LEVEL_NONE, &source) != BT_GRAPH_ADD_COMPONENT_STATUS_OK)
        throw TraceError(folder.string() +
                         " is a CTF trace that is cut off or damaged and cannot be read: " + reason());
      const std::uint64_t ports = bt_component_source_get_output_port_count(source);
      for (std::uint64_t p = 0; p < ports; ++p)
        bt_graph_connect_ports(graph.get(), bt_component_source_borrow_output_port_by_index_const(source, p),
                               bt_component_filter_borrow_input_port_by_index_const(muxer, connected++),
                               nullptr);
    }
    const bt_component_sink* sink = nullptr;
    bt_graph_add_simple_sink_component(graph.get(), "import", nullptr, &Reader::consume, nullptr, this,
                                       &sink);
    bt_graph_connect_ports(graph.get(), bt_component_filter_borrow_output_port_by_index_const(muxer, 0),
                           bt_component_sink_borrow_input_port_by_index_const(sink, 0), nullptr);
    const bt_graph_run_status status = bt_graph_run(graph.get());
    if (failure_) std::rethrow_exception(failure_);
    if (status != BT_GRAPH_RUN_STATUS_OK) {
      set_broken_off();
      if (reading_.all_events == 0)
        throw TraceError(folders.front().string() +
                         " is a CTF trace that cannot be read: " + reading_.broken_off);
    }
    return std::move(reading_);
  }

 private:
  /// The library's last error without its details.
  static std::string reason() {
    const std::string message = last_error();
    return message.substr(0, message.find(": "));
  }

  void set_broken_off() {
    reading_.broken_off = reason();
    // The library's message when a stream's clock falls behind.
    if (reading_.broken_off.find("timestamp is less than") == std::string::npos) return;
    std::ostringstream words;
    words << "its clock jumps back after " << std::fixed << std::setprecision(1)
          << static_cast<double>(reading_.length().count()) / 1e9 << " s";
    reading_.broken_off = words.str();
  }

  static bt_graph_simple_sink_component_consume_func_status consume(bt_message_iterator* messages,
                                                                    void* reader) {
    bt_message_array_const batch = nullptr;
    std::uint64_t count = 0;
    switch (bt_message_iterator_next(messages, &batch, &count)) {
      case BT_MESSAGE_ITERATOR_NEXT_STATUS_OK:
        break;
      case BT_MESSAGE_ITERATOR_NEXT_STATUS_END:
        return BT_GRAPH_SIMPLE_SINK_COMPONENT_CONSUME_FUNC_STATUS_END;
      case BT_MESSAGE_ITERATOR_NEXT_STATUS_AGAIN:
        return BT_GRAPH_SIMPLE_SINK_COMPONENT_CONSUME_FUNC_STATUS_AGAIN;
      default:
        return BT_GRAPH_SIMPLE_SINK_COMPONENT_CONSUME_FUNC_STATUS_ERROR;
    }
    Reader& self = *static_cast<Reader*>(reader);
    for (std::uint64_t i = 0; i < count; ++i) {
      if (!self.failure_) self.take(batch[i]);
      bt_message_put_ref(batch[i]);
    }
    return self.failure_ ? BT_GRAPH_SIMPLE_SINK_COMPONENT_CONSUME_FUNC_STATUS_ERROR
                         : BT_GRAPH_SIMPLE_SINK_COMPONENT_CONSUME_FUNC_STATUS_OK;
  }

  void take(const bt_message* message) {
    const auto count = [&](auto get) -> std::uint64_t {
      std::uint64_t known = 0;
      return get(message, &known) == BT_PROPERTY_AVAILABILITY_AVAILABLE ? known : 1;
    };
    const bt_message_type type = bt_message_get_type(message);
    if (type == BT_MESSAGE_TYPE_EVENT) {
      event(message);
    } else if (type == BT_MESSAGE_TYPE_DISCARDED_EVENTS) {
      reading_.discarded_events += count(bt_message_discarded_events_get_count);
    } else if (type == BT_MESSAGE_TYPE_DISCARDED_PACKETS) {
      reading_.discarded_packets += count(bt_message_discarded_packets_get_count);
    }
  }

  /// No exception may pass through the library, which is written in C.
  void event(const bt_message* message) {
    try {
      const bt_event* const event = bt_message_event_borrow_event_const(message);
      const EventClass& known = class_of(event);
      ++*known.count;
      std::int64_t ns = 0;
      bt_clock_snapshot_get_ns_from_origin(bt_message_event_borrow_default_clock_snapshot_const(message),
                                           &ns);
      const Time at{Duration(ns)};
      clock_offset_ = ns - static_cast<std::int64_t>(bt_clock_snapshot_get_value(
                               bt_message_event_borrow_default_clock_snapshot_const(message)));
      if (++reading_.all_events == 1) reading_.first = reading_.last = at;
      if (at - reading_.last > reading_.longest_gap) {
        reading_.longest_gap = at - reading_.last;
        reading_.gap_begin = reading_.last;
      }
      reading_.last = at;
      if (known.format != nullptr) visit(event, known, at);
    } catch (...) {
      failure_ = std::current_exception();
    }
  }

  void visit(const bt_event* event, const EventClass& known, Time at) {
    const bt_field* const context = bt_event_borrow_common_context_field_const(event);
    const bt_field* const payload = bt_event_borrow_payload_field_const(event);
    const bt_packet* const packet = bt_event_borrow_packet_const(event);
    Event out;
    out.kind = known.format->kind;
    out.at = at;
    out.process = static_cast<std::uint32_t>(number_in(member(context, known.process)));
    out.thread = static_cast<std::uint32_t>(number_in(member(context, known.thread)));
    if (packet != nullptr && known.processor != kNoField) {
      const bt_field* const processor = member(bt_packet_borrow_context_field_const(packet), known.processor);
      out.processor = static_cast<std::int32_t>(number_in(processor));
    }
    auto number = out.number.begin();
    auto text = out.text.begin();
    for (std::size_t i = 0; i < known.fields.size(); ++i) {
      const bt_field* const field = member(payload, known.fields[i]);
      const FieldType type = known.format->fields()[i].type;
      if (type == FieldType::text) {
        *text++ = text_in(field);
        continue;
      }
      *number = type == FieldType::gid ? bytes_in(field, 0) : number_in(field);
      if (type == FieldType::instant && field != nullptr)
        *number += static_cast<std::uint64_t>(clock_offset_);
      if (type == FieldType::gid) *++number = bytes_in(field, 8);
      ++number;
    }
    visit_(out);
  }

  const EventClass& class_of(const bt_event* event) {
    const bt_event_class* const event_class = bt_event_borrow_class_const(event);
    const auto [at, is_new] = classes_.try_emplace(event_class);
    EventClass& known = at->second;
    if (!is_new) return known;
    const char* const given = bt_event_class_get_name(event_class);
    const std::string name = given != nullptr ? given : "?";
    known.count = &reading_.events[name];
    const EventFormat* const format = find_format(name);
    if (format == nullptr || format->role == EventRole::only_kept) return known;
    known.format = format;
    const bt_field_class* const payload = bt_event_class_borrow_payload_field_class_const(event_class);
    for (const EventField& field : format->fields()) known.fields.push_back(position(payload, field.name));
    const bt_stream_class* const stream = bt_event_class_borrow_stream_class_const(event_class);
    const auto* const context = bt_stream_class_borrow_event_common_context_field_class_const(stream);
    known.process = position(context, "vpid");
    known.thread = position(context, "vtid");
    known.processor = position(bt_stream_class_borrow_packet_context_field_class_const(stream), "cpu_id");
    return known;
  }

  const std::function<void(const Event&)>& visit_;
  std::int64_t clock_offset_ = 0;  // ns from a reading of the clock to the time of the event
  TraceReading reading_;
  std::unordered_map<const bt_event_class*, EventClass> classes_;
  std::exception_ptr failure_;
};

}  // namespace

TraceReading CtfTrace::read(const std::function<void(const Event&)>& visit) const {
  TraceReading reading = Reader(visit).read(folders_);
  if (reading.broken_off.empty()) reading.broken_off = cut_;
  return reading;
}

}  // namespace hotpath::tracing
