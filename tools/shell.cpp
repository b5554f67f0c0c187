// Commands by /bin/sh.
#include "shell.h"

#include <fmt/format.h>
#include <sys/wait.h>

#include <cstdio>

namespace nacre::tools {

std::string quote_words(const std::vector<std::string>& words) {
  std::string line;
  for (const std::string& word : words) {
    line += line.empty() ? "'" : " '";
    for (const char c : word) line += c == '\'' ? std::string("'\\''") : std::string(1, c);
    line += '\'';
  }
  return line;
}

CommandResult run_command(const std::vector<std::string>& words) {
  const std::string line = "trap '' INT; exec " + quote_words(words) + " 2>&1 </dev/null";
  CommandResult result;
  FILE* const pipe = ::popen(line.c_str(), "re");
  if (!pipe) return result;
  char buffer[4096];
  while (const std::size_t got = std::fread(buffer, 1, sizeof buffer, pipe))
    result.output.append(buffer, got);
  const int status = ::pclose(pipe);
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  return result;
}

}  // namespace nacre::tools
