// SPDX-License-Identifier: Apache-2.0
#include "import/ctf_writer.hpp"

#include <babeltrace2/babeltrace.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "program/errors.hpp"

namespace hotpath {

namespace {

/// Events of one packet; memory maps limit the size of a packet.
constexpr std::size_t kPacket = 50'000;

/// The source component: emits the events one by one.
class Source {
 public:
  explicit Source(const WrittenTrace& trace) : trace_(trace) {
    for (const WrittenEvent& e : trace.events)
      streams_.resize(std::max<std::size_t>(streams_.size(), e.processor + 1U));
  }
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;
  ~Source() {
    for (const Stream& s : streams_) {
      bt_packet_put_ref(s.packet);
      bt_stream_put_ref(s.stream);
    }
    for (const bt_event_class* c : event_classes_) bt_event_class_put_ref(c);
    bt_stream_class_put_ref(stream_class_);
    bt_trace_put_ref(bt_trace_);
    bt_trace_class_put_ref(trace_class_);
  }

  static bt_component_class_initialize_method_status initialize(bt_self_component_source* self,
                                                                bt_self_component_source_configuration*,
                                                                const bt_value*, void* data) {
    auto& source = *static_cast<Source*>(data);
    bt_self_component* const component = bt_self_component_source_as_self_component(self);
    bt_self_component_set_data(component, data);
    bt_self_component_source_add_output_port(self, "out", nullptr, nullptr);
    source.declare(component);
    return BT_COMPONENT_CLASS_INITIALIZE_METHOD_STATUS_OK;
  }

  static bt_message_iterator_class_next_method_status next(bt_self_message_iterator* iterator,
                                                           bt_message_array_const messages,
                                                           std::uint64_t capacity, std::uint64_t* count) {
    bt_self_component* const component = bt_self_message_iterator_borrow_component(iterator);
    auto& source = *static_cast<Source*>(bt_self_component_get_data(component));
    *count = 0;
    while (*count < capacity) {
      const bt_message* const message = source.next_message(iterator);
      if (message == nullptr) break;
      messages[(*count)++] = message;
    }
    return *count > 0 ? BT_MESSAGE_ITERATOR_CLASS_NEXT_METHOD_STATUS_OK
                      : BT_MESSAGE_ITERATOR_CLASS_NEXT_METHOD_STATUS_END;
  }

 private:
  struct Stream {
    bt_stream* stream = nullptr;
    bt_packet* packet = nullptr;
    std::size_t events = 0;  ///< Of the packet.
    bool ended = false;
  };

  static void member(bt_field_class* structure, const char* name, bt_field_class* of) {
    bt_field_class_structure_append_member(structure, name, of);
    bt_field_class_put_ref(of);
  }

  void declare(bt_self_component* self) {
    trace_class_ = bt_trace_class_create(self);
    stream_class_ = bt_stream_class_create(trace_class_);
    bt_clock_class* const clock = bt_clock_class_create(self);
    bt_clock_class_set_name(clock, "monotonic");
    bt_clock_class_set_frequency(clock, 1'000'000'000);
    bt_stream_class_set_default_clock_class(stream_class_, clock);
    bt_clock_class_put_ref(clock);
    bt_stream_class_set_supports_packets(stream_class_, BT_TRUE, BT_TRUE, BT_TRUE);
    bt_field_class* const packet = bt_field_class_structure_create(trace_class_);
    member(packet, "cpu_id", bt_field_class_integer_unsigned_create(trace_class_));
    bt_stream_class_set_packet_context_field_class(stream_class_, packet);
    bt_field_class_put_ref(packet);
    bt_field_class* const context = bt_field_class_structure_create(trace_class_);
    member(context, "vpid", bt_field_class_integer_signed_create(trace_class_));
    member(context, "vtid", bt_field_class_integer_signed_create(trace_class_));
    member(context, "procname", bt_field_class_string_create(trace_class_));
    bt_stream_class_set_event_common_context_field_class(stream_class_, context);
    bt_field_class_put_ref(context);
    for (const WrittenFormat& format : trace_.formats) {
      bt_event_class* const event = bt_event_class_create(stream_class_);
      bt_event_class_set_name(event, format.name);
      bt_field_class* const payload = bt_field_class_structure_create(trace_class_);
      for (const WrittenFormat::Field& field : format.fields)
        member(payload, field.name, class_of(field.type));
      bt_event_class_set_payload_field_class(event, payload);
      bt_field_class_put_ref(payload);
      event_classes_.push_back(event);
    }
    bt_trace_ = bt_trace_create(trace_class_);
    bt_trace_set_name(bt_trace_, "ust");
    bt_trace_set_environment_entry_string(bt_trace_, "tracer_name", "lttng-ust");
    bt_trace_set_environment_entry_string(bt_trace_, "domain", "ust");
    for (Stream& s : streams_) s.stream = bt_stream_create(stream_class_, bt_trace_);
  }

  bt_field_class* class_of(FieldType type) const {
    switch (type) {
      case FieldType::text:
        return bt_field_class_string_create(trace_class_);
      case FieldType::integer:
        return bt_field_class_integer_signed_create(trace_class_);
      case FieldType::address:
        break;
    }
    bt_field_class* const address = bt_field_class_integer_unsigned_create(trace_class_);
    bt_field_class_integer_set_preferred_display_base(
        address, BT_FIELD_CLASS_INTEGER_PREFERRED_DISPLAY_BASE_HEXADECIMAL);
    return address;
  }

  /// Emits beginnings of streams and packets before their first event. nullptr: the end.
  const bt_message* next_message(bt_self_message_iterator* iterator) {
    if (begun_ < streams_.size())
      return bt_message_stream_beginning_create(iterator, streams_[begun_++].stream);
    if (at_ == trace_.events.size()) return end(iterator);
    const WrittenEvent& event = trace_.events[at_];
    Stream& stream = streams_[event.processor];
    const auto now = static_cast<std::uint64_t>(event.at_ns);
    if (stream.packet != nullptr && stream.events == kPacket) return end_packet(iterator, stream, now);
    if (stream.packet == nullptr) {
      stream.packet = bt_packet_create(stream.stream);
      stream.events = 0;
      bt_field* const cpu =
          bt_field_structure_borrow_member_field_by_index(bt_packet_borrow_context_field(stream.packet), 0);
      bt_field_integer_unsigned_set_value(cpu, event.processor);
      return bt_message_packet_beginning_create_with_default_clock_snapshot(iterator, stream.packet, now);
    }
    ++at_;
    ++stream.events;
    return event_message(iterator, stream, event);
  }

  const bt_message* event_message(bt_self_message_iterator* iterator, const Stream& stream,
                                  const WrittenEvent& e) {
    bt_message* const message = bt_message_event_create_with_packet_and_default_clock_snapshot(
        iterator, event_classes_[e.format], stream.packet, static_cast<std::uint64_t>(e.at_ns));
    bt_event* const event = bt_message_event_borrow_event(message);
    bt_field* const context = bt_event_borrow_common_context_field(event);
    const auto field = [](bt_field* of, std::uint64_t i) {
      return bt_field_structure_borrow_member_field_by_index(of, i);
    };
    bt_field_integer_signed_set_value(field(context, 0), e.process);
    bt_field_integer_signed_set_value(field(context, 1), e.thread);
    bt_field_string_set_value(field(context, 2), trace_.process_name.c_str());
    bt_field* const payload = bt_event_borrow_payload_field(event);
    const auto& fields = trace_.formats[e.format].fields;
    for (std::size_t i = 0; i < fields.size(); ++i) {
      switch (fields[i].type) {
        case FieldType::address:
          bt_field_integer_unsigned_set_value(field(payload, i), e.values[i]);
          break;
        case FieldType::integer:
          bt_field_integer_signed_set_value(field(payload, i), static_cast<std::int64_t>(e.values[i]));
          break;
        case FieldType::text:
          bt_field_string_set_value(field(payload, i), trace_.texts[e.values[i]].c_str());
          break;
      }
    }
    return message;
  }

  const bt_message* end_packet(bt_self_message_iterator* iterator, Stream& stream, std::uint64_t now) {
    const bt_message* const message =
        bt_message_packet_end_create_with_default_clock_snapshot(iterator, stream.packet, now);
    bt_packet_put_ref(stream.packet);
    stream.packet = nullptr;
    return message;
  }

  const bt_message* end(bt_self_message_iterator* iterator) {
    const auto now = static_cast<std::uint64_t>(trace_.events.empty() ? 0 : trace_.events.back().at_ns);
    for (Stream& stream : streams_) {
      if (stream.packet != nullptr) return end_packet(iterator, stream, now);
      if (!std::exchange(stream.ended, true)) return bt_message_stream_end_create(iterator, stream.stream);
    }
    return nullptr;
  }

  const WrittenTrace& trace_;
  std::vector<Stream> streams_;
  std::vector<const bt_event_class*> event_classes_;
  bt_trace_class* trace_class_ = nullptr;
  bt_stream_class* stream_class_ = nullptr;
  bt_trace* bt_trace_ = nullptr;
  std::size_t begun_ = 0, at_ = 0;
};

[[noreturn]] void fail(const std::filesystem::path& folder) {
  const bt_error* const error = bt_current_thread_take_error();
  std::string cause = "libbabeltrace2 gives no reason";
  if (error != nullptr) {
    cause = bt_error_cause_get_message(bt_error_borrow_cause_by_index(error, 0));
    bt_error_release(error);
  }
  throw RunError(folder.string() + ": the trace cannot be written: " + cause);
}

}  // namespace

void write_ctf(const std::filesystem::path& folder, const WrittenTrace& trace) {
  Source source(trace);
  const bt_plugin* ctf = nullptr;
  if (bt_plugin_find("ctf", BT_TRUE, BT_FALSE, BT_TRUE, BT_FALSE, BT_FALSE, &ctf) != BT_PLUGIN_FIND_STATUS_OK)
    fail(folder);
  bt_message_iterator_class* const iterator = bt_message_iterator_class_create(&Source::next);
  bt_component_class_source* const source_class = bt_component_class_source_create("run", iterator);
  bt_component_class_source_set_initialize_method(source_class, &Source::initialize);
  bt_graph* const graph = bt_graph_create(0);
  const bt_component_source* from = nullptr;
  const bt_component_sink* to = nullptr;
  bt_value* const params = bt_value_map_create();
  bt_value_map_insert_string_entry(params, "path", folder.c_str());
  bt_value_map_insert_bool_entry(params, "quiet", BT_TRUE);
  bt_value_map_insert_bool_entry(params, "assume-single-trace", BT_TRUE);
  const bool ready =
      bt_graph_add_source_component_with_initialize_method_data(graph, source_class, "run", nullptr, &source,
                                                                BT_LOGGING_LEVEL_NONE,
                                                                &from) == BT_GRAPH_ADD_COMPONENT_STATUS_OK &&
      bt_graph_add_sink_component(graph, bt_plugin_borrow_sink_component_class_by_name_const(ctf, "fs"), "fs",
                                  params, BT_LOGGING_LEVEL_NONE, &to) == BT_GRAPH_ADD_COMPONENT_STATUS_OK &&
      bt_graph_connect_ports(graph, bt_component_source_borrow_output_port_by_index_const(from, 0),
                             bt_component_sink_borrow_input_port_by_index_const(to, 0),
                             nullptr) == BT_GRAPH_CONNECT_PORTS_STATUS_OK;
  const bool done = ready && bt_graph_run(graph) == BT_GRAPH_RUN_STATUS_OK;
  bt_value_put_ref(params);
  bt_graph_put_ref(graph);
  bt_component_class_source_put_ref(source_class);
  bt_message_iterator_class_put_ref(iterator);
  bt_plugin_put_ref(ctf);
  if (!done) fail(folder);
}

}  // namespace hotpath
