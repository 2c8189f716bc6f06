/* Busbar plugin ABI 1.0. The rules that hold everywhere are in `busbar/plugin.h`.
 * Generated from plugins/sdk/abi/src/simulator.rs by cbindgen; the test `header` compares the two.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * Capability `busbar.simulator/1-draft`: simulated devices, so that a configuration can be tried
 * without its devices.
 *
 * The plugin listens where its settings say that the device is, and has every tag at
 * its address. What value a tag has at an instant follows from the seed, the tag's id,
 * its behaviour and the scenario alone (`busbar_plugin_sdk::simulation` has the formulas).
 */

#ifndef BUSBAR_SIMULATOR_H
#define BUSBAR_SIMULATOR_H

#include <stddef.h>
#include <stdint.h>
#include <busbar/plugin.h>
#include <busbar/telemetry.h>

// Id of the capability.
#define BUSBAR_SIMULATOR_ID "busbar.simulator/1-draft"

// Capacity of the text of a `BusbarSimulatorStatus`, bytes.
#define BUSBAR_SIMULATOR_MESSAGE_CAPACITY 512

// Fault of a lost link: connections end, and new ones are refused.
#define BUSBAR_FAULT_LINK_LOSS 1

// Fault of a slow device: every answer is delayed, but within the deadline.
#define BUSBAR_FAULT_SLOW 2

// Fault of half-open connections, through which no bytes come.
#define BUSBAR_FAULT_HALF_OPEN 4

// Fault of connections that are reset, again and again.
#define BUSBAR_FAULT_RESET 8

// Fault of random bytes instead of answers.
#define BUSBAR_FAULT_GARBAGE 16

// Fault of answers after the client's deadline.
#define BUSBAR_FAULT_LATE 32

// Fault of a wrong device clock.
#define BUSBAR_FAULT_CLOCK_JUMP 64

// Shape of a simulated signal.
enum BusbarSignalShape
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Shape of a constant at the base.
  BUSBAR_SIGNAL_SHAPE_CONSTANT = 0,
  // Shape of a sine about the base.
  BUSBAR_SIGNAL_SHAPE_SINE = 1,
  // Shape of a smooth random walk about the base.
  BUSBAR_SIGNAL_SHAPE_WALK = 2,
  // Shape of levels about the base, or positions of a switch, each held for a period.
  BUSBAR_SIGNAL_SHAPE_STEPS = 3,
  // Shape of a counter: one more each period, from the base to base and amplitude, then anew.
  BUSBAR_SIGNAL_SHAPE_COUNTER = 4,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BusbarSignalShape BusbarSignalShape;
#else
typedef uint32_t BusbarSignalShape;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Kind of a scenario event.
enum BusbarSimulatedEventKind
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Event of a tag that moves to a value and stays there.
  BUSBAR_SIMULATED_EVENT_KIND_VALUE = 0,
  // Event of a tag that follows its own shape again.
  BUSBAR_SIMULATED_EVENT_KIND_RELEASE = 1,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BusbarSimulatedEventKind BusbarSimulatedEventKind;
#else
typedef uint32_t BusbarSimulatedEventKind;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Interval in which the link has a fault. Array element.
typedef struct BusbarLinkFault {
  // Kind of the fault, one of `BUSBAR_FAULT_*`.
  uint32_t fault;
  // Reserved; must be zero.
  uint32_t reserved;
  // Begin of the fault, seconds since the scenario began; not negative.
  double at_seconds;
  // Duration of the fault, seconds; more than 0.
  double for_seconds;
} BusbarLinkFault;

// Scenario event of a simulated tag. Array element.
typedef struct BusbarSimulatedEvent {
  // Handle of the tag.
  uint32_t tag;
  // Kind of the event.
  BusbarSimulatedEventKind kind;
  // Time of the event, seconds since the scenario began; not negative.
  double at_seconds;
  // Duration of the ramp to the value, seconds; not negative, 0 for bool and double-point.
  double over_seconds;
  // Target value in the tag's unit; 0 or 1 for bool, 0 to 3 for double-point.
  double value;
} BusbarSimulatedEvent;

// Simulated tag. Array element.
typedef struct BusbarSimulatedTag {
  // Specification of the tag, as for telemetry.
  struct BusbarTagSpec spec;
  // Shape of the signal.
  BusbarSignalShape shape;
  // Reserved; must be zero.
  uint32_t reserved;
  // Base value of the signal, in the tag's unit; 0 or 1 for bool, 0 to 3 for double-point.
  double base;
  // Amplitude about the base, in the tag's unit; not negative.
  double amplitude;
  // Period of a wave, a level or a count, seconds; more than 0.
  double period_seconds;
} BusbarSimulatedTag;

// Parameters of a simulation, for all its tags.
typedef struct BusbarSimulation {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Kinds of random faults, a sum of `BUSBAR_FAULT_*`; 0 for none.
  uint32_t faults;
  // Seed of the random numbers: the same seed gives the same values and the same faults.
  uint64_t seed;
  // Period in which changes are looked for, milliseconds; more than 0. Of no
  // meaning to protocols whose devices only answer.
  uint64_t update_millis;
  // Period in which one fault occurs, milliseconds; more than `fault_millis`.
  uint64_t fault_period_millis;
  // Longest duration of a random fault, milliseconds; more than 0.
  uint64_t fault_millis;
  // Start of the scenario, nanoseconds since 1970-01-01 UTC; a plugin that is restarted
  // continues it.
  int64_t scenario_unix_nanos;
  // Number of events in `events`.
  uint32_t event_count;
  // Number of link faults.
  uint32_t link_fault_count;
  // Scenario events of tags, in the order of time.
  const struct BusbarSimulatedEvent *events;
  // Scenario faults of the link, in the order of time.
  const struct BusbarLinkFault *link_faults;
} BusbarSimulation;

// Status of a simulation.
typedef struct BusbarSimulatorStatus {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Present fault, one of `BUSBAR_FAULT_*`; 0 for none.
  uint32_t fault;
  // Number of clients that are connected.
  uint32_t clients;
  // Used bytes of `message`.
  uint32_t message_len;
  // Number of connections accepted so far.
  uint64_t connections;
  // Number of messages sent so far: answers to requests, and unsolicited ones.
  uint64_t messages;
  // Address that the simulator listens at, UTF-8.
  uint8_t message[BUSBAR_SIMULATOR_MESSAGE_CAPACITY];
} BusbarSimulatorStatus;

// Function table of `busbar.simulator/1-draft`. It is independent of `busbar.telemetry/2-draft`,
// which the plugin may also have.
typedef struct BusbarSimulator {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Reserved; must be zero.
  uint32_t reserved;
  // `[serialized & idle]` Listens, serves tags on threads of the plugin's own, and returns at
  // once. Tags and simulation are valid during the call. Fails with `BUSBAR_INVALID_SETTINGS`
  // when an address is wrong or cannot hold the values of its tag. The message names every tag
  // at fault that it has room for. Fails with `BUSBAR_FAILED` when the plugin cannot listen. The
  // plugin is then idle.
  BusbarStatus (*start)(const struct BusbarPlugin *plugin,
                        const struct BusbarSimulatedTag *tags,
                        size_t tag_count,
                        const struct BusbarSimulation *simulation,
                        struct BusbarError *error);
  // `[serialized & active]` Ends all connections and threads within two seconds,
  // and listens no more.
  void (*stop)(const struct BusbarPlugin *plugin);
  // `[serialized & active]` Fills in the status of the simulation.
  BusbarStatus (*status)(const struct BusbarPlugin *plugin,
                         struct BusbarSimulatorStatus *status,
                         struct BusbarError *error);
} BusbarSimulator;

#endif  /* BUSBAR_SIMULATOR_H */
