#pragma once

namespace sls::app {

/// From now on SIGINT and SIGTERM only set a flag; loops end their step and close their files.
/// SIGPIPE and SIGXFSZ are ignored: the failing write reports them.
void install_stop_signals();

/// 0, or the number of the first stop signal received.
int stop_signal();

}  // namespace sls::app
