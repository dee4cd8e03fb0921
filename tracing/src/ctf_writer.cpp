// SPDX-License-Identifier: Apache-2.0
#include "hotpath/tracing/ctf_trace.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>
#include <vector>

#include "babeltrace.hpp"

namespace hotpath::tracing {

namespace {

/// Events of one packet; memory maps limit the size of a packet.
constexpr std::size_t kPacket = 50'000;

using FieldClass = Owned<bt_field_class, bt_field_class_put_ref>;

/// The source component: emits the events one by one.
class Source {
 public:
  Source(std::span<const Event> events, const std::string& process_name)
      : events_(events), process_name_(process_name), event_classes_(kEvents.size()) {
    for (const Event& e : events)
      streams_.resize(std::max(streams_.size(), static_cast<std::size_t>(e.processor) + 1));
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
    Owned<bt_stream, bt_stream_put_ref> stream;
    Owned<bt_packet, bt_packet_put_ref> packet;
    std::size_t events = 0;  ///< Of the packet.
    bool ended = false;
  };

  static void append(const FieldClass& structure, const char* name, bt_field_class* member) {
    bt_field_class_structure_append_member(structure.get(), name, FieldClass(member).get());
  }

  void declare(bt_self_component* self) {
    trace_class_.reset(bt_trace_class_create(self));
    bt_trace_class* const of = trace_class_.get();
    stream_class_.reset(bt_stream_class_create(of));
    const Owned<bt_clock_class, bt_clock_class_put_ref> clock(bt_clock_class_create(self));
    bt_clock_class_set_name(clock.get(), "monotonic");
    bt_clock_class_set_frequency(clock.get(), 1'000'000'000);
    bt_stream_class_set_default_clock_class(stream_class_.get(), clock.get());
    bt_stream_class_set_supports_packets(stream_class_.get(), BT_TRUE, BT_TRUE, BT_TRUE);
    const FieldClass packet(bt_field_class_structure_create(of));
    append(packet, "cpu_id", bt_field_class_integer_unsigned_create(of));
    bt_stream_class_set_packet_context_field_class(stream_class_.get(), packet.get());
    const FieldClass context(bt_field_class_structure_create(of));
    append(context, "vpid", bt_field_class_integer_signed_create(of));
    append(context, "vtid", bt_field_class_integer_signed_create(of));
    append(context, "procname", bt_field_class_string_create(of));
    bt_stream_class_set_event_common_context_field_class(stream_class_.get(), context.get());
    for (const EventFormat& format : kEvents)
      if (std::ranges::find(events_, format.kind, &Event::kind) != events_.end()) declare(format);
    trace_.reset(bt_trace_create(of));
    bt_trace_set_name(trace_.get(), "ust");
    bt_trace_set_environment_entry_string(trace_.get(), "tracer_name", "lttng-ust");
    bt_trace_set_environment_entry_string(trace_.get(), "domain", "ust");
    for (Stream& s : streams_) s.stream.reset(bt_stream_create(stream_class_.get(), trace_.get()));
  }

  void declare(const EventFormat& format) {
    EventClass& event = event_classes_[static_cast<std::size_t>(format.kind)];
    event.reset(bt_event_class_create(stream_class_.get()));
    bt_event_class_set_name(event.get(), format.name);
    const FieldClass payload(bt_field_class_structure_create(trace_class_.get()));
    for (const EventField& field : format.fields()) append(payload, field.name, class_of(field.type));
    bt_event_class_set_payload_field_class(event.get(), payload.get());
  }

  bt_field_class* class_of(FieldType type) const {
    bt_trace_class* const of = trace_class_.get();
    if (type == FieldType::text) return bt_field_class_string_create(of);
    if (type == FieldType::integer || type == FieldType::instant)
      return bt_field_class_integer_signed_create(of);
    if (type == FieldType::gid) {
      const FieldClass byte(bt_field_class_integer_unsigned_create(of));
      bt_field_class_integer_set_field_value_range(byte.get(), 8);
      return bt_field_class_array_static_create(of, byte.get(), 16);
    }
    bt_field_class* const address = bt_field_class_integer_unsigned_create(of);
    bt_field_class_integer_set_preferred_display_base(
        address, BT_FIELD_CLASS_INTEGER_PREFERRED_DISPLAY_BASE_HEXADECIMAL);
    return address;
  }

  /// Emits beginnings of streams and packets before their first event. nullptr: the end.
  const bt_message* next_message(bt_self_message_iterator* iterator) {
    if (begun_ < streams_.size())
      return bt_message_stream_beginning_create(iterator, streams_[begun_++].stream.get());
    if (at_ == events_.size()) return end(iterator);
    const Event& event = events_[at_];
    Stream& stream = streams_[static_cast<std::size_t>(event.processor)];
    if (stream.packet && stream.events == kPacket) return end_packet(iterator, stream, ns(event));
    if (!stream.packet) {
      stream.packet.reset(bt_packet_create(stream.stream.get()));
      stream.events = 0;
      bt_field_integer_unsigned_set_value(member(bt_packet_borrow_context_field(stream.packet.get()), 0),
                                          static_cast<std::uint64_t>(event.processor));
      return bt_message_packet_beginning_create_with_default_clock_snapshot(iterator, stream.packet.get(),
                                                                            ns(event));
    }
    ++at_;
    ++stream.events;
    return event_message(iterator, stream, event);
  }

  const bt_message* event_message(bt_self_message_iterator* iterator, const Stream& stream,
                                  const Event& e) const {
    bt_message* const message = bt_message_event_create_with_packet_and_default_clock_snapshot(
        iterator, event_classes_[static_cast<std::size_t>(e.kind)].get(), stream.packet.get(), ns(e));
    bt_event* const event = bt_message_event_borrow_event(message);
    bt_field* const context = bt_event_borrow_common_context_field(event);
    bt_field_integer_signed_set_value(member(context, 0), e.process);
    bt_field_integer_signed_set_value(member(context, 1), e.thread);
    bt_field_string_set_value(member(context, 2), process_name_.c_str());
    auto number = e.number.begin();
    auto text = e.text.begin();
    for (std::size_t i = 0; const EventField& of : format_of(e.kind).fields()) {
      bt_field* const field = member(bt_event_borrow_payload_field(event), i++);
      if (of.type == FieldType::text) {
        bt_field_string_set_value(field, *text++);
      } else if (of.type == FieldType::gid) {
        for (const std::uint64_t first : {0U, 8U}) set_bytes(field, first, *number++);
      } else if (of.type == FieldType::address) {
        bt_field_integer_unsigned_set_value(field, *number++);
      } else {
        bt_field_integer_signed_set_value(field, static_cast<std::int64_t>(*number++));
      }
    }
    return message;
  }

  /// Eight elements from position `first` on, the first one highest.
  static void set_bytes(bt_field* array, std::uint64_t first, std::uint64_t bytes) {
    for (std::uint64_t i = 0; i < 8; ++i) {
      bt_field_integer_unsigned_set_value(bt_field_array_borrow_element_field_by_index(array, first + i),
                                          bytes >> (56 - 8 * i) & 0xff);
    }
  }
  static bt_field* member(bt_field* structure, std::uint64_t i) {
    return bt_field_structure_borrow_member_field_by_index(structure, i);
  }
  static std::uint64_t ns(const Event& e) {
    return static_cast<std::uint64_t>(e.at.time_since_epoch().count());
  }

  static const bt_message* end_packet(bt_self_message_iterator* iterator, Stream& stream, std::uint64_t now) {
    const auto packet = std::exchange(stream.packet, nullptr);
    return bt_message_packet_end_create_with_default_clock_snapshot(iterator, packet.get(), now);
  }

  const bt_message* end(bt_self_message_iterator* iterator) {
    for (Stream& stream : streams_) {
      if (stream.packet) return end_packet(iterator, stream, ns(events_.back()));
      if (!std::exchange(stream.ended, true))
        return bt_message_stream_end_create(iterator, stream.stream.get());
    }
    return nullptr;
  }

  using EventClass = Owned<bt_event_class, bt_event_class_put_ref>;
  const std::span<const Event> events_;
  const std::string& process_name_;
  Owned<bt_trace_class, bt_trace_class_put_ref> trace_class_;
  Owned<bt_stream_class, bt_stream_class_put_ref> stream_class_;
  std::vector<EventClass> event_classes_;  // by kind; null: no event has it
  Owned<bt_trace, bt_trace_put_ref> trace_;
  std::vector<Stream> streams_;
  std::size_t begun_ = 0, at_ = 0;
};

}  // namespace

void write_ctf(const std::filesystem::path& folder, std::span<const Event> events,
               const std::string& process_name) {
  Source source(events, process_name);
  const OwnedPlugin ctf = find_plugin("ctf");
  const Owned<bt_message_iterator_class, bt_message_iterator_class_put_ref> iterator(
      bt_message_iterator_class_create(&Source::next));
  const Owned<bt_component_class_source, bt_component_class_source_put_ref> source_class(
      bt_component_class_source_create("run", iterator.get()));
  bt_component_class_source_set_initialize_method(source_class.get(), &Source::initialize);
  const OwnedValue params(bt_value_map_create());
  bt_value_map_insert_string_entry(params.get(), "path", folder.c_str());
  bt_value_map_insert_bool_entry(params.get(), "quiet", BT_TRUE);
  bt_value_map_insert_bool_entry(params.get(), "assume-single-trace", BT_TRUE);
  const OwnedGraph graph(bt_graph_create(0));
  const bt_component_source* from = nullptr;
  const bt_component_sink* to = nullptr;
  const bool done =
      bt_graph_add_source_component_with_initialize_method_data(graph.get(), source_class.get(), "run",
                                                                nullptr, &source, BT_LOGGING_LEVEL_NONE,
                                                                &from) == BT_GRAPH_ADD_COMPONENT_STATUS_OK &&
      bt_graph_add_sink_component(
          graph.get(), bt_plugin_borrow_sink_component_class_by_name_const(ctf.get(), "fs"), "fs",
          params.get(), BT_LOGGING_LEVEL_NONE, &to) == BT_GRAPH_ADD_COMPONENT_STATUS_OK &&
      bt_graph_connect_ports(graph.get(), bt_component_source_borrow_output_port_by_index_const(from, 0),
                             bt_component_sink_borrow_input_port_by_index_const(to, 0),
                             nullptr) == BT_GRAPH_CONNECT_PORTS_STATUS_OK &&
      bt_graph_run(graph.get()) == BT_GRAPH_RUN_STATUS_OK;
  if (!done) throw std::runtime_error(folder.string() + ": the trace cannot be written: " + last_error());
}

}  // namespace hotpath::tracing
