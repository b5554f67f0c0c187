// Other programs: their command lines, and running them.
#pragma once

#include <string>
#include <vector>

namespace nacre::tools {

/// Words as /bin/sh reads them back, whatever they hold.
std::string quote_words(const std::vector<std::string>& words);

struct CommandResult {
  int exit_code = -1;  // 127: there is no such program
  std::string output;  // standard output and error together
};
/// Runs a program to its end, without input. Ctrl-C on the terminal does not reach it.
CommandResult run_command(const std::vector<std::string>& words);

}  // namespace nacre::tools
