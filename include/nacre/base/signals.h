// What ends a program from outside, in an orderly way.
#pragma once

namespace nacre {

/// For `main`, once, before anything is opened. From then on
/// - SIGINT, SIGTERM and SIGHUP (unless they were ignored) say so in one line on standard error, remove
/// temporary
///   files and end the program by that signal, as shells and schedulers expect it;
/// - SIGBUS, raised where a file that is read in place was cut short, names that file and exits with 1;
/// - a closed pipe or a limit on the size of files is an error of the write, not a signal;
/// - standard input, output and error are open, so that no other file takes their place.
void handle_signals() noexcept;

}  // namespace nacre
