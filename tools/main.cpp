// The program: subcommands, errors, exit codes.
#include <malloc.h>
#include <sys/resource.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <iostream>
#include <new>
#include <system_error>

#include "common.h"
#include "nacre/base/error.h"
#include "nacre/base/progress.h"
#include "nacre/base/signals.h"
#include "nacre/base/version.h"

namespace {

constexpr rlim_t kLeastStack = rlim_t{1} << 20;  // bytes, of every thread

std::string join_arguments(int argc, char** argv) {
  std::string line = "nacre";
  for (int i = 1; i < argc; ++i) line += std::string(" ") + argv[i];
  return line;
}

int report_error(const std::string& message, int code) {
  nacre::print_message(fmt::format("nacre: error: {}\n", message));
  return code;
}

int report_output(int number) {
  return report_error(fmt::format("standard output: cannot write: {}", std::strerror(number)), 1);
}

int run(int argc, char** argv) {
  CLI::App app{
      "nacre renders translucent materials: bake irradiance once, render from any camera with any material"};
  app.set_version_flag("--version", std::string("nacre ") + nacre::kVersion);
  app.require_subcommand(1);
  app.option_defaults()->always_capture_default(false);
  const std::string line = join_arguments(argc, argv);
  nacre::tools::add_bake_command(app, line);
  nacre::tools::add_render_command(app, line);
  nacre::tools::add_sweep_command(app, line);
  nacre::tools::add_info_command(app, line);
  nacre::tools::add_merge_command(app, line);
  nacre::tools::add_diff_command(app, line);
  nacre::tools::add_materials_command(app, line);
  nacre::tools::add_export_commands(app, line);
  try {
    app.parse(argc, argv);
    return 0;
  } catch (const CLI::Success& success) {
    return app.exit(success);
  } catch (const CLI::RuntimeError& result) {
    return result.get_exit_code();
  } catch (const CLI::ParseError& error) {
    return report_error(std::string(error.what()) + "; see `nacre --help`", 2);
  } catch (const nacre::tools::UsageError& error) {
    return report_error(error.what(), 2);
  } catch (const nacre::Error& error) {
    return report_error(error.what(), 1);
  } catch (const std::bad_alloc&) {
    return report_error(
        "out of memory; use fewer samples (--spacing, --points), a smaller picture (--size) or a machine "
        "that has more",
        1);
  } catch (const std::system_error& error) {
    if (std::ferror(stdout)) return report_output(error.code().value());
    return report_error(error.what(), 1);
  } catch (const std::exception& error) {
    return report_error(error.what(), 1);
  }
}

}  // namespace

int main(int argc, char** argv) {
  nacre::handle_signals();
  if (rlimit stack{}; ::getrlimit(RLIMIT_STACK, &stack) == 0 && stack.rlim_cur < kLeastStack)
    return report_error(fmt::format("stacks are limited to {} kB; nacre wants {}: run `ulimit -s {}` first",
                                    stack.rlim_cur >> 10, kLeastStack >> 10, kLeastStack >> 10),
                        1);
  // Memory that is given back is soon wanted again: keep it, rather than have the system clear it each time.
  mallopt(M_MMAP_THRESHOLD, 1 << 30);
  mallopt(M_TRIM_THRESHOLD, 1 << 30);
  const int code = run(argc, argv);
  // What was printed may still have to be written.
  errno = 0;
  if ((std::fflush(stdout) == 0 && !std::ferror(stdout) && std::cout) || code != 0) return code;
  return report_output(errno != 0 ? errno : EIO);
}
