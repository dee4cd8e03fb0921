// SPDX-License-Identifier: Apache-2.0
#include "import/ctf_reader.hpp"

#include <babeltrace2/babeltrace.h>

#include <memory>
#include <optional>
#include <unordered_map>

#include "hotpath/core/utf8.hpp"
#include "program/errors.hpp"
#include "program/text.hpp"

namespace hotpath {

namespace {

namespace fs = std::filesystem;

template <auto put>
struct Put {
  template <class T>
  void operator()(T* object) const {
    put(object);
  }
};
using Graph = std::unique_ptr<bt_graph, Put<bt_graph_put_ref>>;
using Value = std::unique_ptr<bt_value, Put<bt_value_put_ref>>;
using Plugin = std::unique_ptr<const bt_plugin, Put<bt_plugin_put_ref>>;
using QueryExecutor = std::unique_ptr<bt_query_executor, Put<bt_query_executor_put_ref>>;

/// The deepest cause of the library's last error.
std::string last_error() {
  const bt_error* const error = bt_current_thread_take_error();
  if (error == nullptr) return "libbabeltrace2 gives no reason";
  const std::string message = bt_error_cause_get_message(bt_error_borrow_cause_by_index(error, 0));
  bt_error_release(error);
  return message.substr(0, message.find(": "));
}

Plugin plugin(const char* name) {
  const bt_plugin* loaded = nullptr;
  if (bt_plugin_find(name, BT_TRUE, BT_FALSE, BT_TRUE, BT_FALSE, BT_FALSE, &loaded) !=
      BT_PLUGIN_FIND_STATUS_OK)
    throw RunError(std::string("libbabeltrace2 has no plugin `") + name + "`: " + last_error());
  return Plugin(loaded);
}

Value inputs_of(const fs::path& folder) {
  Value params(bt_value_map_create());
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

std::string_view string_in(const bt_field* field) {
  if (field == nullptr || bt_field_get_class_type(field) != BT_FIELD_CLASS_TYPE_STRING) return {};
  return bt_field_string_get_value(field);
}

constexpr std::uint64_t kNoField = ~std::uint64_t{0};

/// The position of a member in a structure's class; kNoField: there is no such member.
std::uint64_t position(const bt_field_class* structure, std::string_view name) {
  if (structure == nullptr || name.empty()) return kNoField;
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
  const TraceEventFormat* format = nullptr;
  std::array<std::uint64_t, 4> numbers{};
  std::array<std::uint64_t, 2> texts{};
  std::uint64_t process = kNoField, thread = kNoField, processor = kNoField;
};

class Reader {
 public:
  Reader(TraceVisitor& visitor, const std::function<void(double)>& progress)
      : visitor_(visitor), progress_(progress) {}

  TraceReading read(const std::vector<fs::path>& folders) {
    trace_ = folders.front().string();
    const Plugin ctf = plugin("ctf"), utils = plugin("utils");
    const auto* const fs_class = bt_plugin_borrow_source_component_class_by_name_const(ctf.get(), "fs");
    const auto* const muxer_class =
        bt_plugin_borrow_filter_component_class_by_name_const(utils.get(), "muxer");
    const Graph graph(bt_graph_create(0));
    const bt_component_filter* muxer = nullptr;
    bt_graph_add_filter_component(graph.get(), muxer_class, "muxer", nullptr, BT_LOGGING_LEVEL_NONE, &muxer);
    std::uint64_t connected = 0;
    for (const fs::path& folder : folders) {
      const bt_component_source* source = nullptr;
      const Value params = inputs_of(folder);
      if (bt_graph_add_source_component(graph.get(), fs_class, folder.c_str(), params.get(),
                                        BT_LOGGING_LEVEL_NONE, &source) != BT_GRAPH_ADD_COMPONENT_STATUS_OK) {
        throw UsageError(folder.string() +
                         " is a CTF trace that is cut off or damaged and cannot be read: " + last_error());
      }
      add_span(fs_class, params.get());
      const std::uint64_t ports = bt_component_source_get_output_port_count(source);
      for (std::uint64_t p = 0; p < ports; ++p) {
        bt_graph_connect_ports(graph.get(), bt_component_source_borrow_output_port_by_index_const(source, p),
                               bt_component_filter_borrow_input_port_by_index_const(muxer, connected++),
                               nullptr);
      }
    }
    const bt_component_sink* sink = nullptr;
    bt_graph_add_simple_sink_component(graph.get(), "import", nullptr, &Reader::consume, nullptr, this,
                                       &sink);
    bt_graph_connect_ports(graph.get(), bt_component_filter_borrow_output_port_by_index_const(muxer, 0),
                           bt_component_sink_borrow_input_port_by_index_const(sink, 0), nullptr);
    const bt_graph_run_status status = bt_graph_run(graph.get());
    if (failure_) std::rethrow_exception(failure_);
    if (status != BT_GRAPH_RUN_STATUS_OK) {
      reading_.broken_off = last_error();
      // The library's message when a stream's clock falls behind.
      if (reading_.broken_off.find("timestamp is less than") != std::string::npos) {
        const double last_s = static_cast<double>(reading_.last_ns - reading_.first_ns) / 1e9;
        reading_.broken_off = text("its clock jumps back after %.1f s", last_s);
      }
      if (reading_.all_events == 0)
        throw UsageError(trace_ + " is a CTF trace that cannot be read: " + reading_.broken_off);
    }
    return std::move(reading_);
  }

 private:
  /// Extends the known time span of the trace, for the progress only.
  void add_span(const bt_component_class_source* fs_class, const bt_value* params) {
    if (!progress_) return;
    const QueryExecutor query(bt_query_executor_create(
        bt_component_class_source_as_component_class_const(fs_class), "babeltrace.trace-infos", params));
    const bt_value* infos = nullptr;
    if (bt_query_executor_query(query.get(), &infos) != BT_QUERY_EXECUTOR_QUERY_STATUS_OK) {
      bt_current_thread_clear_error();
      return;
    }
    for (std::uint64_t t = 0; t < bt_value_array_get_length(infos); ++t) {
      const bt_value* const trace = bt_value_array_borrow_element_by_index_const(infos, t);
      const bt_value* const streams = bt_value_map_borrow_entry_value_const(trace, "stream-infos");
      for (std::uint64_t s = 0; streams != nullptr && s < bt_value_array_get_length(streams); ++s) {
        const bt_value* const range = bt_value_map_borrow_entry_value_const(
            bt_value_array_borrow_element_by_index_const(streams, s), "range-ns");
        if (range == nullptr) continue;
        const bt_value* const end = bt_value_map_borrow_entry_value_const(range, "end");
        if (end != nullptr) end_ns_ = std::max(end_ns_, bt_value_integer_signed_get(end));
      }
    }
    bt_value_put_ref(infos);
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
    self.tell_progress();
    return self.failure_ ? BT_GRAPH_SIMPLE_SINK_COMPONENT_CONSUME_FUNC_STATUS_ERROR
                         : BT_GRAPH_SIMPLE_SINK_COMPONENT_CONSUME_FUNC_STATUS_OK;
  }

  void take(const bt_message* message) {
    std::uint64_t count = 0;
    switch (bt_message_get_type(message)) {
      case BT_MESSAGE_TYPE_EVENT:
        return event(message);
      case BT_MESSAGE_TYPE_DISCARDED_EVENTS: {
        const bool known =
            bt_message_discarded_events_get_count(message, &count) == BT_PROPERTY_AVAILABILITY_AVAILABLE;
        reading_.discarded_events += known ? count : 1;
        return;
      }
      case BT_MESSAGE_TYPE_DISCARDED_PACKETS: {
        const bool known =
            bt_message_discarded_packets_get_count(message, &count) == BT_PROPERTY_AVAILABILITY_AVAILABLE;
        reading_.discarded_packets += known ? count : 1;
        return;
      }
      default:
        return;
    }
  }

  /// No exception may pass through the library, which is written in C.
  void event(const bt_message* message) {
    try {
      const bt_event* const event = bt_message_event_borrow_event_const(message);
      const EventClass& known = class_of(event);
      ++*known.count;
      ++reading_.all_events;
      TraceEvent out;
      bt_clock_snapshot_get_ns_from_origin(bt_message_event_borrow_default_clock_snapshot_const(message),
                                           &out.at_ns);
      if (reading_.all_events == 1) reading_.first_ns = out.at_ns;
      if (reading_.all_events > 1 && out.at_ns - reading_.last_ns > reading_.longest_gap_ns) {
        reading_.longest_gap_ns = out.at_ns - reading_.last_ns;
        reading_.gap_begin_ns = reading_.last_ns;
      }
      reading_.last_ns = out.at_ns;
      if (known.format != nullptr) visit(event, known, out);
    } catch (...) {
      failure_ = std::current_exception();
    }
  }

  void visit(const bt_event* event, const EventClass& known, TraceEvent& out) {
    const bt_field* const context = bt_event_borrow_common_context_field_const(event);
    const bt_field* const payload = bt_event_borrow_payload_field_const(event);
    const bt_packet* const packet = bt_event_borrow_packet_const(event);
    out.kind = known.format->kind;
    out.process = static_cast<std::uint32_t>(number_in(member(context, known.process)));
    out.thread = static_cast<std::uint32_t>(number_in(member(context, known.thread)));
    if (packet != nullptr && known.processor != kNoField) {
      const bt_field* const at = member(bt_packet_borrow_context_field_const(packet), known.processor);
      out.processor = static_cast<std::int32_t>(number_in(at));
    }
    for (std::size_t i = 0; i < known.numbers.size(); ++i)
      if (known.numbers[i] != kNoField) out.number[i] = number_in(member(payload, known.numbers[i]));
    for (std::size_t i = 0; i < known.texts.size(); ++i) {
      if (known.texts[i] == kNoField) continue;
      out.text[i] = string_in(member(payload, known.texts[i]));
      check_name(out.text[i], known.format->name);
    }
    visitor_.visit(out);
  }

  void check_name(std::string_view name, std::string_view where) const {
    if (is_utf8(name)) return;
    throw UsageError(concat(trace_, " is a damaged CTF trace: a name in `", where,
                            "` is not valid UTF-8; record it again"));
  }

  const EventClass& class_of(const bt_event* event) {
    const bt_event_class* const event_class = bt_event_borrow_class_const(event);
    const auto [at, is_new] = classes_.try_emplace(event_class);
    EventClass& known = at->second;
    if (!is_new) return known;
    const char* const name = bt_event_class_get_name(event_class);
    if (name != nullptr) check_name(name, "metadata");
    known.count = &reading_.events[name != nullptr ? name : "?"];
    for (const TraceEventFormat& format : trace_event_formats()) {
      if (name != nullptr && format.name == name) known.format = &format;
    }
    if (known.format == nullptr) return known;
    const bt_field_class* const payload = bt_event_class_borrow_payload_field_class_const(event_class);
    for (std::size_t i = 0; i < known.numbers.size(); ++i)
      known.numbers[i] = position(payload, known.format->numbers[i]);
    for (std::size_t i = 0; i < known.texts.size(); ++i)
      known.texts[i] = position(payload, known.format->texts[i]);
    const bt_stream_class* const stream = bt_event_class_borrow_stream_class_const(event_class);
    const auto* const context = bt_stream_class_borrow_event_common_context_field_class_const(stream);
    known.process = position(context, "vpid");
    known.thread = position(context, "vtid");
    known.processor = position(bt_stream_class_borrow_packet_context_field_class_const(stream), "cpu_id");
    return known;
  }

  void tell_progress() {
    if (!progress_ || end_ns_ <= reading_.first_ns || reading_.all_events == 0) return;
    progress_(static_cast<double>(reading_.last_ns - reading_.first_ns) /
              static_cast<double>(end_ns_ - reading_.first_ns));
  }

  TraceVisitor& visitor_;
  const std::function<void(double)>& progress_;
  TraceReading reading_;
  std::string trace_;
  std::unordered_map<const bt_event_class*, EventClass> classes_;
  std::exception_ptr failure_;
  std::int64_t end_ns_ = 0;
};

}  // namespace

TraceReading read_ctf(const WholePackets& trace, TraceVisitor& visitor,
                      const std::function<void(double)>& progress) {
  TraceReading reading = Reader(visitor, progress).read(trace.folders());
  if (reading.broken_off.empty()) reading.broken_off = trace.cut();
  return reading;
}

}  // namespace hotpath
