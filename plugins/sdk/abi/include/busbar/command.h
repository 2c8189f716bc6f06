/* Busbar plugin ABI 1.0. The rules that hold everywhere are in `busbar/plugin.h`.
 * Generated from plugins/sdk/abi/src/command.rs by cbindgen; the test `header` compares the two.
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * Capability `busbar.command/1-draft`: subcommands of the program that a plugin offers.
 *
 * A command reads one stream of bytes and writes another. The host opens the files; the
 * plugin sees bytes alone, in pieces, so that neither holds a whole file in memory.
 */

#ifndef BUSBAR_COMMAND_H
#define BUSBAR_COMMAND_H

#include <stddef.h>
#include <stdint.h>
#include <busbar/plugin.h>

// Id of the capability.
#define BUSBAR_COMMAND_ID "busbar.command/1-draft"

// Commands of one plugin, at most.
#define BUSBAR_MAX_COMMANDS 16

// Bytes of a command's name, at most.
#define BUSBAR_MAX_COMMAND_NAME 32

// Bytes of one `write`, at most.
#define BUSBAR_MAX_CHUNK (1 << 20)

// Exit code of a command.
enum BusbarExitCode
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : uint32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
  // Exit code of a command that is done.
  BUSBAR_EXIT_CODE_DONE = 0,
  // Exit code of a command whose input is at fault; nothing could be done.
  BUSBAR_EXIT_CODE_INPUT = 1,
  // Exit code of a command whose arguments are at fault.
  BUSBAR_EXIT_CODE_USAGE = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum BusbarExitCode BusbarExitCode;
#else
typedef uint32_t BusbarExitCode;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Command that a plugin offers. Valid until `destroy`.
typedef struct BusbarCommandInfo {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Reserved; must be zero.
  uint32_t reserved;
  // Name that users type: a lower-case letter, then lower-case letters, digits and `-`.
  struct BusbarStr name;
  // Help text of one line.
  struct BusbarStr help;
} BusbarCommandInfo;

// Call of a command, with its arguments.
typedef struct BusbarCommandCall {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Number of arguments in `arguments`.
  uint32_t argument_count;
  // Name of the command.
  struct BusbarStr name;
  // Arguments that users wrote for the plugin, besides files.
  const struct BusbarStr *arguments;
} BusbarCommandCall;

// Input, output and diagnostics of a command. Valid during `run`, on its thread alone.
typedef struct BusbarCommandStreams {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Reserved; must be zero.
  uint32_t reserved;
  // Context that is passed back in every call.
  void *context;
  // `[the thread of the call]` Reads at most `capacity` bytes of the input into `buffer`.
  // Returns their number, 0 at the end of the input. Below 0, the plugin must stop and return
  // `BUSBAR_CANCELLED`.
  int64_t (*read)(void *context, uint8_t *buffer, size_t capacity);
  // `[the thread of the call]` Takes `len` bytes of output, at most
  // `BUSBAR_MAX_CHUNK`, copying them. Returns 0 if the plugin must stop and return
  // `BUSBAR_CANCELLED`.
  uint32_t (*write)(void *context, const uint8_t *bytes, size_t len);
  // `[the thread of the call]` Reports a diagnostic on the input. `line` is a line of the
  // input, 1 the first, 0 for none. Messages beyond the host's limit are counted, not kept.
  // Cannot fail.
  void (*diagnose)(void *context, BusbarLogLevel level, uint64_t line, struct BusbarStr message);
} BusbarCommandStreams;

// Result of a command. The caller owns it and fills in `struct_size`.
typedef struct BusbarCommandResult {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Exit code of the command.
  BusbarExitCode exit_code;
} BusbarCommandResult;

// Function table of `busbar.command/1-draft`.
typedef struct BusbarCommand {
  // Size of this struct, bytes.
  uint32_t struct_size;
  // Reserved; must be zero.
  uint32_t reserved;
  // `[serialized]` Number of commands, at most `BUSBAR_MAX_COMMANDS`.
  uint32_t (*count)(const struct BusbarPlugin *plugin);
  // `[serialized]` Returns a command's description, valid until `destroy`, or null if `index`
  // is too large.
  const struct BusbarCommandInfo *(*describe)(const struct BusbarPlugin *plugin, uint32_t index);
  // `[serialized]` Runs a command: reads the input as far as it needs, writes its output in
  // order, and fills in the exit code. All arguments are borrowed for the call. A fault of the
  // input is a diagnostic and at worst `BUSBAR_EXIT_CODE_INPUT`, no failure. Fails with
  // `BUSBAR_INVALID_ARGUMENT` for a name that the plugin does not offer, with
  // `BUSBAR_CANCELLED`, `BUSBAR_FAILED` or `BUSBAR_INTERNAL`.
  BusbarStatus (*run)(const struct BusbarPlugin *plugin,
                      const struct BusbarCommandCall *call,
                      const struct BusbarCommandStreams *streams,
                      struct BusbarCommandResult *result,
                      struct BusbarError *error);
} BusbarCommand;

#endif  /* BUSBAR_COMMAND_H */
