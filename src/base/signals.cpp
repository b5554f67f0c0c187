// Handlers, which may use nothing that could be in the middle of its work.
#include "nacre/base/signals.h"

#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <cstring>

#include "base/files_in_use.h"

namespace nacre {
namespace {

bool on_terminal = false;  // a line of progress may stand there

void say(const char* text) noexcept {
  [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, text, std::strlen(text));
}

void die_of(int signal) noexcept {
  ::signal(signal, SIG_DFL);
  ::raise(signal);
}

extern "C" void on_interruption(int signal) {
  say(on_terminal ? "\nnacre: interrupted by " : "nacre: interrupted by ");
  say(signal == SIGINT ? "SIGINT" : signal == SIGTERM ? "SIGTERM" : "SIGHUP");
  say("; no file is left half-written; the same command goes on where a bake, a sweep or a film was\n");
  remove_temporaries();
  die_of(signal);
}

extern "C" void on_missing_page(int signal, siginfo_t* info, void*) {
  const char* const path = mapped_at(info->si_addr);
  if (!path) return die_of(signal);
  say(on_terminal ? "\nnacre: error: " : "nacre: error: ");
  say(path);
  say(": was cut short, or its disk failed, while it was read; replace files that are in use by renaming\n");
  remove_temporaries();
  ::_exit(1);
}

}  // namespace

void handle_signals() noexcept {
  // Writing to a standard output that is closed is an error; a closed standard error is where nobody listens.
  for (int descriptor = STDIN_FILENO; descriptor <= STDERR_FILENO; ++descriptor)
    if (::fcntl(descriptor, F_GETFD) < 0)
      ::open("/dev/null", descriptor == STDERR_FILENO ? O_WRONLY : O_RDONLY);
  on_terminal = ::isatty(STDERR_FILENO);
  ::signal(SIGPIPE, SIG_IGN);
  ::signal(SIGXFSZ, SIG_IGN);
  struct sigaction action {};
  ::sigemptyset(&action.sa_mask);
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction before {};
    action.sa_handler = on_interruption;
    if (::sigaction(signal, nullptr, &before) == 0 && before.sa_handler != SIG_IGN)
      ::sigaction(signal, &action, nullptr);
  }
  action.sa_flags = SA_SIGINFO;
  action.sa_sigaction = on_missing_page;
  ::sigaction(SIGBUS, &action, nullptr);
}

}  // namespace nacre
