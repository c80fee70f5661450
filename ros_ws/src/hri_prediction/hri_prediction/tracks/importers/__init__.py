"""Motion capture files of other people's software, one format a module, as arm tracks."""
