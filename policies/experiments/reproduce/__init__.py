"""Every table and figure of Hussein & Begum (CoRL 2022) by one command, `teasim reproduce`."""
